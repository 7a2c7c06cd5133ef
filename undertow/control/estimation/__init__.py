"""Estimation of the lumped uncertainty: fuzzy system, identification model, and a sampled disturbance observer."""

from undertow.control.estimation.fuzzy_system import FuzzySystem as FuzzySystem
from undertow.control.estimation.fuzzy_system import gaussian_sets as gaussian_sets
from undertow.control.estimation.series_parallel import SeriesParallel as SeriesParallel
