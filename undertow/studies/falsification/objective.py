"""What the searches ask: robustness of departures, counted against the budget, and the smallest violation so far."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.studies.falsification.box import Box

Departures = Float[np.ndarray, "p k"]


class BudgetSpent(Exception):
    """The budget does not allow another run."""


class Broken(Exception):
    """A violation was found, where the first one ends a search."""


class Violation(NamedTuple):
    """A departure that breaks a requirement."""

    departure: np.ndarray
    seed: int  # of its run
    robustness: float
    size: float  # norm of the departure, relative to the bounds
    runs: int  # so far, when it was found


Watch = Callable[[int, float, Violation | None], None]  # runs so far, least robustness so far, smallest violation


class RobustnessObjective:
    """Robustness of departures, with a budget of runs.

    Until a requirement is broken, the runs have all seeds in turn: which realization of noise and sea breaks it is part
    of the search. Afterwards all have the seed of the smallest violation, unless others are asked for.

    Args:
        compute: robustness of departures with their seeds, many at once.
        box: what varies.
        seeds: of the runs.
        budget: number of runs.
        watch: called after every batch.
    """

    def __init__(
        self,
        compute: Callable[[Departures, Sequence[int]], np.ndarray],
        box: Box,
        seeds: Sequence[int],
        budget: int,
        watch: Watch,
    ):
        self._compute, self.box, self.seeds, self.budget, self._watch = compute, box, tuple(seeds), budget, watch
        self.departures: list[np.ndarray] = []
        self.robustnesses: list[float] = []
        self.violations: list[Violation] = []  # each smaller than the one before

    @property
    def runs(self) -> int:
        """Number of runs so far."""
        return len(self.robustnesses)

    @property
    def smallest(self) -> Violation | None:
        """The smallest violation so far."""
        return self.violations[-1] if self.violations else None

    def robustness(self, departures: Departures, seeds: Sequence[int] | None = None) -> Float[np.ndarray, " p"]:
        """Robustness of every departure, which is clipped to the box.

        Args:
            departures: where.
            seeds: of the runs; None for those of the present phase.

        Raises:
            BudgetSpent: the budget allows only some of the runs, which are done and counted.
        """
        allowed = departures[: self.budget - self.runs]
        if len(allowed):
            inside = np.clip(allowed, self.box.lower, self.box.upper)
            chosen = list(seeds or self._present(len(departures)))[: len(allowed)]
            computed = self._compute(inside, chosen)
            for departure, seed, robustness in zip(inside, chosen, computed.tolist(), strict=True):
                self._note(departure, seed, robustness)
            self._watch(self.runs, min(self.robustnesses), self.smallest)
            if len(allowed) == len(departures):
                return computed
        raise BudgetSpent

    def _present(self, count: int) -> list[int]:
        if self.smallest is not None:
            return [self.smallest.seed] * count
        return [self.seeds[number % len(self.seeds)] for number in range(self.runs, self.runs + count)]

    def _note(self, departure: np.ndarray, seed: int, robustness: float) -> None:
        self.departures.append(departure)
        self.robustnesses.append(robustness)
        size = float(self.box.size(departure))
        if robustness <= 0 and (self.smallest is None or size < self.smallest.size):
            self.violations.append(Violation(departure, seed, robustness, size, self.runs))


_WORST = 1e6  # cost of a departure whose scenario cannot be built


class ToBreak:
    """The cost of the first phase, over the unit cube: the robustness. The first violation ends it."""

    def __init__(self, objective: RobustnessObjective, slope: Callable[[np.ndarray], np.ndarray]):
        self._objective, self._slope = objective, slope

    def costs(self, points: np.ndarray) -> np.ndarray:
        """Robustness of each point.

        Raises:
            Broken: a point breaks a requirement.
        """
        robustness = self._objective.robustness(self._objective.box.of_cube(points))
        if self._objective.smallest is not None:
            raise Broken
        return np.minimum(robustness, _WORST)

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the robustness with respect to the point."""
        box = self._objective.box
        departure = box.of_cube(point[None])[0]
        slopes = []
        for axis, away in zip(box.axes, departure, strict=True):
            reach = axis.nominal - axis.low if away < 0 else axis.high - axis.nominal
            slopes.append((axis.high - axis.low) / (reach or np.inf))
        return self._slope(departure) * np.array(slopes)


_UNBROKEN = 10.0  # cost beside robustness: above the size of every departure in a box of up to a hundred numbers


class ToShrink:
    """The cost of the second phase, over the unit cube: the size of a violation; above all of them what breaks nothing.

    Deb (2000): of two points that break nothing the one with less robustness is better.
    """

    def __init__(self, objective: RobustnessObjective):
        self._objective = objective

    def costs(self, points: np.ndarray) -> np.ndarray:
        """Cost of each point."""
        departures = self._objective.box.of_cube(points)
        robustness = self._objective.robustness(departures)
        sizes = self._objective.box.size(departures)
        return np.where(robustness <= 0, sizes, _UNBROKEN + np.minimum(robustness, _WORST))
