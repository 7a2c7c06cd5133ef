"""Dives cut into segments, each with a first guess of the motion at its begin."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.studies.identification.dive import Dive

RUN_IN = 2.0  # s; actuators forget within tenths of a second
_NEAR = 0.3  # s around the begin of a segment, whose samples give the guess
# What the motion at the begin may differ from the guess, one standard deviation: m, rad, m/s, rad/s.
START_DEVIATION = np.repeat([0.5, 0.2, 0.3, 0.3], 3)


class Segments(NamedTuple):
    """Segments of dives, each with a leading axis over them.

    Attributes:
        inputs: of the run-in and the segment, shape (S, run-in + length, N).
        values, offsets, spreads, counts: as in `Dive`, of the segment, shape (S, length, ...).
        start: guess of position, quaternion, nu, shape (S, 13).
        dive: number of the dive, shape (S,).
        first: step of the dive at which the segment begins, shape (S,).
        gains: of a filter that follows the motion, from residuals to a change of the motion and of what pushes it, (S,
            length, 18, 13); None where predictions run freely.
        whitening: makes the residuals of the filter white noise of variance 1, (S, length, 13, 13).
        push_kept: share of a push that is left after a step, (S,).
    """

    inputs: np.ndarray
    values: np.ndarray
    offsets: np.ndarray
    spreads: np.ndarray
    counts: np.ndarray
    start: np.ndarray
    dive: np.ndarray
    first: np.ndarray
    gains: np.ndarray | None = None
    whitening: np.ndarray | None = None
    push_kept: np.ndarray | None = None


def segments_of(dives: Sequence[Dive], length: float) -> Segments:
    """Dives cut into segments of a length in s; what is left at their ends is filled with steps without samples.

    Args:
        dives: with equal steps.
        length: s.
    """
    step = dives[0].step
    before, steps = round(RUN_IN / step), max(2, round(length / step))
    rows = []
    for number, dive in enumerate(dives):
        total = len(dive.inputs)
        for first in range(min(before, total // 4), total - steps // 4, steps):
            rows.append(_segment(dive, number, first, before, steps))
    return Segments(*(np.stack(column) for column in zip(*rows, strict=True)))


def whole(dive: Dive) -> Segments:
    """A dive as a single segment from its first step on, whose actuators have run in with its first input."""
    row = _segment(dive, 0, 0, round(RUN_IN / dive.step), len(dive.inputs))
    return Segments(*(np.asarray(column)[None] for column in row))


def _segment(dive: Dive, number: int, first: int, before: int, steps: int):
    inputs = dive.inputs[max(0, first - before) : first + steps]
    missing = max(0, before - first)
    inputs = np.vstack([np.repeat(inputs[:1], missing, axis=0), inputs])
    lacking = before + steps - len(inputs)
    inputs = np.vstack([inputs, np.repeat(inputs[-1:], lacking, axis=0)])
    pad = lambda rows: np.concatenate([rows, np.zeros((steps - len(rows), rows.shape[1]), rows.dtype)])
    part = slice(first, first + steps)
    values = pad(dive.values[part])
    values[len(dive.values[part]) :, 3] = 1.0
    measured = (pad(rows[part]) for rows in (dive.offsets, dive.spreads, dive.counts))
    return inputs, values, *measured, start_of(dive, first), number, first


def start_of(dive: Dive, first: int) -> np.ndarray:
    """Position, quaternion and nu at a step, from the samples around it; zero where a sensor has none at all."""
    near = max(2, round(_NEAR / dive.step))
    position = _about(dive, 0, slice(0, 3), first, near)
    if not dive.counts[:, 0].any() and dive.counts[:, 4].any():
        position[2] = _about(dive, 4, slice(13, 14), first, near)[0]
    quaternion = _about(dive, 1, slice(3, 7), first, near)
    norm = np.linalg.norm(quaternion)
    quaternion = quaternion / norm if norm > 0 else np.array([1.0, 0.0, 0.0, 0.0])
    velocity = _about(dive, 2, slice(7, 10), first, near)
    rates = _about(dive, 3, slice(10, 13), first, near)
    return np.concatenate([position, quaternion, velocity, rates])


def _about(dive: Dive, sensor: int, columns: slice, first: int, near: int) -> np.ndarray:
    """Values of a sensor at a step: a line through the samples around it, or the nearest one."""
    measured = np.flatnonzero(dive.counts[:, sensor])
    values = dive.values[:, columns]
    if not len(measured):
        return np.zeros(values.shape[1])
    around = measured[np.abs(measured - first) <= near]
    if len(around) < 4:
        return values[measured[np.argmin(np.abs(measured - first))]]
    times = around + dive.offsets[around, sensor] - first
    slope_and_value = np.polyfit(times, values[around], 1)
    return slope_and_value[1]
