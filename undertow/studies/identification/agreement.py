"""How the changes of a pose follow from a velocity: a matrix and an offset of the clocks, fitted over windows."""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from undertow.logs import frames
from undertow.logs.log_signals import Series
from undertow.studies.identification.clock_offset import ClockOffset, offset_of
from undertow.studies.identification.outliers import outliers

Stream = tuple[np.ndarray, np.ndarray]  # times (rows,) and values (rows, columns)

_OFFSETS = 0.05 * np.arange(-20, 21)  # s
_TURN_WINDOW, _STEP_WINDOW = 0.3, 1.0  # s
_FEWEST = 15  # windows
_HUBER = 3.0
_ROUNDS = 5


class Agreement(NamedTuple):
    """How the changes of a pose follow from a velocity.

    Attributes:
        matrix: that takes the integrated velocity to the changes, (3, 3).
        explained: share of the changes that it explains, outliers at less weight.
        contributions: size of each entry beside the change that it gives, (3, 3).
        offset: of the velocity behind the pose.
        change: typical size of the changes on each axis, (3,).
    """

    matrix: np.ndarray
    explained: float
    contributions: np.ndarray
    offset: ClockOffset
    change: np.ndarray


def agreement_of_turns(attitude: Series, rates: Stream, unit: float) -> Agreement | None:
    """Of angles times a unit in rad with an angular velocity; None where there are too few samples."""
    is_finite = np.isfinite(attitude.values).all(axis=1)
    time, quaternions = attitude.time[is_finite], frames.quaternions(unit * attitude.values[is_finite])
    ends = _windows(time, _TURN_WINDOW)
    if len(ends) < _FEWEST or len(rates[0]) < _FEWEST:
        return None
    rotation = Rotation.from_quat(quaternions, scalar_first=True)
    first, last = ends.T
    turns = (rotation[first].inv() * rotation[last]).as_rotvec()
    return _agreement(time[first], time[last], turns, rates)


def agreement_of_steps(attitude: Stream, position: Stream, velocity: Stream) -> Agreement | None:
    """Of positions, in axes turned by quaternions, with a velocity; None where there are too few samples."""
    keep = ~outliers(position[1]) if len(position[0]) > _FEWEST else np.ones(len(position[0]), dtype=bool)
    time, places = position[0][keep], position[1][keep]
    ends = _windows(time, _STEP_WINDOW)
    if min(len(ends), len(velocity[0]), len(attitude[0])) < _FEWEST:
        return None
    first, last = ends.T
    middle = (time[first] + time[last]) / 2
    quaternions = np.stack([np.interp(middle, attitude[0], column) for column in attitude[1].T], axis=1)
    quaternions[np.linalg.norm(quaternions, axis=1) < 1e-9] = (1.0, 0.0, 0.0, 0.0)
    steps = Rotation.from_quat(quaternions, scalar_first=True).inv().apply(places[last] - places[first])
    return _agreement(time[first], time[last], steps, velocity)


def _windows(time: np.ndarray, length: float) -> np.ndarray:
    """Numbers of samples about a length apart, shape (windows, 2); none across a gap."""
    starts = np.searchsorted(time, np.arange(time[0], time[-1], length)) if len(time) > 1 else np.zeros(0, dtype=int)
    starts = np.unique(np.clip(starts, 0, max(len(time) - 1, 0)))
    pairs = np.array(list(itertools.pairwise(starts)), dtype=int).reshape(-1, 2)
    return pairs[time[pairs[:, 1]] - time[pairs[:, 0]] < 2 * length] if len(pairs) else pairs


def _agreement(begin: np.ndarray, end: np.ndarray, changes: np.ndarray, velocity: Stream) -> Agreement | None:
    """The fitted matrix at the offset of the clocks where it explains most."""
    time, values = velocity
    keep = ~outliers(values)
    time, values = time[keep], values[keep]
    trapezoids = np.diff(time)[:, None] * (values[1:] + values[:-1]) / 2
    integral = np.vstack([np.zeros(3), np.cumsum(trapezoids, axis=0)])
    at = lambda times: np.stack([np.interp(times, time, column) for column in integral.T], axis=1)
    margin = float(_OFFSETS[-1])
    inside = (begin - margin > time[0]) & (end + margin < time[-1])
    if inside.sum() < _FEWEST:
        return None
    begin, end, changes = begin[inside], end[inside], changes[inside]
    fits = [_robust_fit(at(end + offset) - at(begin + offset), changes) for offset in _OFFSETS]
    offset = offset_of([error for _, error in fits], _OFFSETS, 3 * len(changes))
    best = int(np.argmin(np.abs(_OFFSETS - offset.delay))) if np.isfinite(offset.deviation) else len(_OFFSETS) // 2
    matrix, error = fits[best]
    integrated = at(end + _OFFSETS[best]) - at(begin + _OFFSETS[best])
    typical = np.maximum(_typical(changes), 1e-12)
    contributions = matrix * _typical(integrated) / typical[:, None]
    explained = 1 - (error / max(float(np.sqrt((_cut(changes) ** 2).mean())), 1e-12)) ** 2
    return Agreement(matrix, explained, contributions, offset, typical)


def _robust_fit(integrated: np.ndarray, changes: np.ndarray) -> tuple[np.ndarray, float]:
    """Matrix of least squares with less weight for outliers (Huber), and the size of what remains."""
    weight = np.ones(len(changes))
    matrix, remaining = np.eye(3), changes
    ridge = 1e-9 * max(float((integrated**2).sum()), 1e-12) * np.eye(3)
    for _ in range(_ROUNDS):
        weighted = weight[:, None] * integrated
        matrix = np.linalg.solve(weighted.T @ integrated + ridge, weighted.T @ changes).T
        remaining = changes - integrated @ matrix.T
        sizes = np.linalg.norm(remaining, axis=1)
        limit = _HUBER * max(float(np.median(sizes)), 1e-12)
        weight = np.minimum(1.0, limit / np.maximum(sizes, 1e-12))
    return matrix, float(np.sqrt((weight[:, None] * remaining**2).mean()))


def _typical(changes: np.ndarray) -> np.ndarray:
    return np.sqrt((_cut(changes) ** 2).mean(axis=0))


def _cut(changes: np.ndarray) -> np.ndarray:
    """Changes with outliers made smaller."""
    limit = 6 * np.maximum(np.median(np.abs(changes), axis=0), 1e-12)
    return np.clip(changes, -limit, limit)
