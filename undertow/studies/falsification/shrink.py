"""The second phase: from a violation to the smallest one.

A ray from the nominal scenario through a departure meets the boundary at a distance that bisection finds. From the
nearest boundary point the direction is improved: towards the point of the linearised boundary that is nearest to the
nominal scenario (Hasofer and Lind 1974, Rackwitz and Fiessler 1978, as in structural reliability), by leaving out one
number after the other, and at random.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from undertow.studies.falsification.box import Box
from undertow.studies.falsification.objective import Departures, RobustnessObjective, ToShrink, Violation
from undertow.studies.tuning.search import search

_SCALES = 16  # points of a ray
_NARROWED = 8  # a bracket is divided by this, at once
_PRECISION = 2e-3  # of a distance, as a share of the length of its ray
_RAYS = 64  # of the corners at most
_STEPS = np.array([1.0, 0.5, 0.2])  # towards the nearest point of the linearised boundary
_SHORTER = np.array([0.002, 0.02, 0.1, 0.3])  # by which a candidate has to be smaller
_LESS = (0.0, 0.7)  # factors on one number of a departure
_NEAR, _BACK = 0.95, 0.05  # a smaller violation is approached along its ray from this share of its distance, less that
_RANDOM = 8  # directions per round
_WIDE, _NARROW = 0.5, 0.02  # spread of random directions, first and last
_ROUNDS = 60
_SWITCHES, _TRIED, _NEARER = 4, 64, 0.95  # to other seeds: at most, seeds each time, at this share of the departure
_GENERATIONS = 1000
_REFINED = 0.01  # relative improvement by the global search that is worth another descent


def corners(objective: RobustnessObjective, chance: np.random.Generator) -> Departures:
    """The ends of all axes and the corners of the box, or as many of these at random as are tried."""
    lower, upper = objective.box.lower, objective.box.upper
    numbers = len(lower)
    ends = np.concatenate([np.diag(lower), np.diag(upper)])
    if 2**numbers <= _RAYS:
        sides = (np.arange(2**numbers)[:, None] >> np.arange(numbers)) & 1
    else:
        sides = chance.integers(0, 2, (_RAYS, numbers))
    candidates = np.unique(np.concatenate([ends, np.where(sides, upper, lower)]), axis=0)
    return candidates[objective.box.size(candidates) > 0]


def shrink(
    objective: RobustnessObjective, slope: Callable[[np.ndarray], np.ndarray], first: Departures, seed: int
) -> None:
    """Look for smaller and smaller violations; the objective keeps them.

    Args:
        objective: has a violation.
        slope: gradient of the robustness.
        first: further departures that the search looks along.
        seed: of all random numbers.

    Raises:
        BudgetSpent: before the search has converged.
    """
    chance = np.random.default_rng(seed)
    at_one_bound = objective.box.size(first) <= 1.0  # one number at its bound
    single_axes = np.concatenate([_smallest(objective).departure[None], first[at_one_bound]])
    for ends in filter(len, (single_axes, first[~at_one_bound])):
        before = _smallest(objective)
        _along(objective, ends)
        if _smallest(objective) is not before:
            _descend(objective, slope, chance)
    _other_seeds(objective, slope, chance)
    before = _smallest(objective)
    search(ToShrink(objective), objective.box.to_cube(before.departure[None])[0], _GENERATIONS, seed)
    if _smallest(objective).size < (1 - _REFINED) * before.size:
        _descend(objective, slope, chance)


def _other_seeds(
    objective: RobustnessObjective, slope: Callable[[np.ndarray], np.ndarray], chance: np.random.Generator
) -> None:
    """Try other seeds a little nearer to the nominal scenario, and go on with one that breaks a requirement there."""
    for _ in range(_SWITCHES if len(objective.seeds) > 1 else 0):
        best = _smallest(objective)
        tried = chance.choice(objective.seeds, min(_TRIED, len(objective.seeds)), replace=False).tolist()
        objective.robustness(np.repeat(_NEARER * best.departure[None], len(tried), axis=0), tried)
        if _smallest(objective) is best:
            return
        _along(objective, _smallest(objective).departure[None])
        _descend(objective, slope, chance)


def _along(objective: RobustnessObjective, ends: Departures) -> None:
    """Find where rays from the nominal scenario to some departures, not beyond the best, first break a requirement."""
    sizes = objective.box.size(ends)
    ends = ends * np.minimum(1.0, _smallest(objective).size / sizes)[:, None]
    scales = np.arange(1, _SCALES + 1) / _SCALES
    departures = (scales[:, None, None] * ends).reshape(-1, ends.shape[1])
    robustness = objective.robustness(departures).reshape(_SCALES, len(ends))
    breaking = (robustness <= 0).any(axis=0)
    firsts = (robustness <= 0).argmax(axis=0)
    lengths = objective.box.size(ends)
    for ray in sorted(np.flatnonzero(breaking), key=lambda ray: firsts[ray] * lengths[ray]):
        if firsts[ray] / _SCALES * lengths[ray] < _smallest(objective).size:
            _bisect(objective, ends[ray], firsts[ray] / _SCALES, (firsts[ray] + 1) / _SCALES)


def _bisect(objective: RobustnessObjective, end: Float[np.ndarray, " k"], holding: float, broken: float) -> None:
    """Narrow the bracket of the distance along a ray at which a requirement breaks."""
    while broken - holding > _PRECISION:
        scales = np.linspace(holding, broken, _NARROWED + 1)[1:-1]
        breaking = objective.robustness(scales[:, None] * end) <= 0
        if breaking.any():
            index = int(breaking.argmax())
            holding, broken = scales[index - 1] if index else holding, scales[index]
        else:
            holding = scales[-1]


def _descend(
    objective: RobustnessObjective, slope: Callable[[np.ndarray], np.ndarray], chance: np.random.Generator
) -> None:
    """Improve the direction of the smallest violation until no candidate is better."""
    spread = _WIDE
    gradient = None
    at = None
    for _ in range(_ROUNDS):
        best = _smallest(objective)
        if at is not best:
            gradient, at = slope(best.departure), best
        ways = _directions(objective.box, best, gradient, spread, chance)
        sizes = best.size * (1 - _SHORTER)
        objective.robustness((sizes[:, None, None] * ways).reshape(-1, ways.shape[1]))
        shorter = _smallest(objective)
        if shorter is not best:
            _bisect(objective, shorter.departure, min(shorter.size / best.size, _NEAR) - _BACK, 1.0)
        elif spread > _NARROW:
            spread /= 2
        else:
            return


def _smallest(objective: RobustnessObjective) -> Violation:
    """The smallest violation of an objective that has one."""
    assert objective.smallest is not None
    return objective.smallest


def _directions(
    box: Box, best: Violation, gradient: np.ndarray | None, spread: float, chance: np.random.Generator
) -> Departures:
    """Directions of norm 1 that may meet the boundary nearer to the nominal scenario."""
    departure = best.departure
    candidates = [best.departure]
    if gradient is not None and gradient.any():
        # The point nearest to the nominal scenario at which the linearised robustness is zero: the departure x of
        # robustness r with gradient g has the plane g.(y - x) + r = 0, whose point of least norm is along g.
        nearest = (gradient @ departure - best.robustness) / (gradient @ gradient) * gradient
        nearest = np.clip(nearest, box.lower, box.upper)
        candidates += [departure + step * (nearest - departure) for step in _STEPS]
    for axis in np.flatnonzero(departure):
        candidates += [np.where(np.arange(len(departure)) == axis, share * departure, departure) for share in _LESS]
    around = best.size * spread * chance.standard_normal((_RANDOM, len(departure)))
    inside = np.clip(np.array([*candidates, *(departure + around)]), box.lower, box.upper)
    sizes = box.size(inside)
    return inside[sizes > 0] / sizes[sizes > 0, None]
