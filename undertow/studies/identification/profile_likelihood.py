"""Intervals by the profile of the likelihood, where that is not the parabola that deviations suppose.

A number is moved away from its estimate, all others are estimated anew, and the cost that is reached grows. The
interval ends where it has grown as much as it would at the end of the usual interval if it were a parabola; Venzon and
Moolgavkar (1988). How long residuals last is counted as in the usual interval.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput, nearest
from undertow.studies.identification.fit import Fit
from undertow.studies.identification.free_parameters import FreeParameter, matching_names
from undertow.studies.identification.least_squares import cost_of, evaluated, improved, residuals_of
from undertow.studies.identification.model import IdentificationModel

_ITERATIONS = 12  # of the other unknowns at a point
_CONVERGED = 0.005  # decrease of the cost
_POINTS = 4  # on each side
_NEAR = 0.03  # relative error of the root of the growth
_FARTHEST = 4.0  # times the usual interval, beyond which there is no end
_LEAST_GROWTH = 0.05  # of the root, as a share of what is looked for: a flat profile has no end


class ProfileInterval(NamedTuple):
    """An interval by the profile of the likelihood; an end that was not found is infinite."""

    low: float
    high: float


def names_in(parameters: Sequence[FreeParameter], profile: Sequence[str]) -> list[str]:
    """Free parameters that names, groups or patterns mean.

    Raises:
        BadInput: one of them means none.
    """
    free = [parameter.name for parameter in parameters]
    for pattern in profile:
        if not matching_names(free, pattern):
            raise BadInput("profile", "name free parameters", pattern, hint=nearest(pattern, free))
    return [name for name in free if any(name in matching_names(free, pattern) for pattern in profile)]


def profile_intervals(
    model: IdentificationModel,
    step: float,
    estimate: Fit,
    least: np.ndarray,
    parameters: Sequence[FreeParameter],
    reaches: np.ndarray,
    names: Sequence[str],
    say: Callable[[str], None],
) -> dict[str, ProfileInterval]:
    """The interval of each parameter of these names; see `profile_interval`."""
    intervals = {}
    for index, parameter in enumerate(parameters):
        if parameter.name in names:
            say(f"profile of {parameter.name}, {len(intervals) + 1} of {len(names)}")
            reach = float(reaches[index])
            intervals[parameter.name] = profile_interval(model, step, estimate, least, parameter, index, reach)
    return intervals


def profile_interval(
    model: IdentificationModel,
    step: float,
    estimate: Fit,
    least: np.ndarray,
    parameter: FreeParameter,
    index: int,
    reach: float,
) -> ProfileInterval:
    """The interval of one parameter.

    Args:
        model, step: with which the estimate was found.
        estimate: see there.
        least: smallest numbers of the unknowns.
        parameter: see there.
        index: of the parameter among the unknowns.
        reach: half the usual interval, in deviations beforehand.
    """
    deviation = np.sqrt(np.linalg.inv(estimate.information)[index, index])
    root = reach / deviation  # of twice the growth of the cost at the end of the interval
    ends = [_end(model, step, estimate, least, index, sign * reach, root) for sign in (-1.0, 1.0)]
    low, high = (float(parameter.value(end)) if np.isfinite(end) else float(np.sign(end) * np.inf) for end in ends)
    return ProfileInterval(max(low, parameter.least), high)


def _end(model, step, estimate: Fit, least, index: int, reach: float, root: float) -> float:
    """Where the root of twice the growth is as large as it should be: the secant from the estimate on."""
    place = reach
    z, starts = estimate.z, estimate.starts
    for _ in range(_POINTS):
        moved_to = max(estimate.z[index] + place, least[index])
        cost, z, starts = _lowest(model, step, estimate, least, index, moved_to, z, starts)
        growth = np.sqrt(max(2 * (cost - estimate.cost), 0.0))
        if moved_to == least[index] and growth < root:
            return moved_to
        if not np.isfinite(growth) or growth < _LEAST_GROWTH * root:
            return float(np.sign(reach) * np.inf)
        if abs(growth / root - 1) < _NEAR:
            break
        place = place * root / growth
        if abs(place) > _FARTHEST * abs(reach):
            return float(np.sign(reach) * np.inf)
    return estimate.z[index] + place


def _lowest(model, step, estimate: Fit, least, index: int, value: float, z: np.ndarray, starts: np.ndarray):
    """The smallest cost with one unknown at a value, and where it is."""
    z = z.copy()
    z[index] = value
    damping = 1e-6
    segments, weights = estimate.segments, estimate.weights
    cost = cost_of(residuals_of(model, segments, step, z, starts), weights, z, starts)
    for _ in range(_ITERATIONS):
        parts = evaluated(model, segments, weights, step, z, starts)
        trial = improved(model, segments, parts, weights, step, z, starts, least, damping, cost, index)
        if trial is None:
            break
        decrease = cost - trial.cost
        z, starts, cost, damping = trial.z, trial.starts, trial.cost, trial.damping
        if decrease < _CONVERGED:
            break
    return cost, z, starts
