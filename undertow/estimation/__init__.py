"""The fuzzy system that carries the estimate of everything unknown."""

from undertow.estimation.tsk import FuzzySystem as FuzzySystem
from undertow.estimation.tsk import gaussian_sets as gaussian_sets
