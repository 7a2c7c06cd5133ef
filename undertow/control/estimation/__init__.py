"""Estimation of the lumped uncertainty: the fuzzy system and the identification model whose error is its input."""

from undertow.control.estimation.fuzzy_system import FuzzySystem as FuzzySystem
from undertow.control.estimation.fuzzy_system import gaussian_sets as gaussian_sets
from undertow.control.estimation.series_parallel import SeriesParallel as SeriesParallel
