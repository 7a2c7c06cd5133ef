"""The fuzzy system that carries the estimate of everything unknown."""

from undertow.fuzzy.tsk import FuzzySystem as FuzzySystem
from undertow.fuzzy.tsk import gaussian_sets as gaussian_sets
