"""A dive with a measured motion in every step: interpolated, and velocities from poses where there are no others."""

import numpy as np
from scipy.spatial.transform import Rotation

from undertow.core.measurement import BODY_AXES
from undertow.studies.identification.dive import COLUMNS, SENSORS, Dive

_LONGEST_GAP = 0.6  # s between samples, over which a motion is not interpolated


def filled(dive: Dive) -> Dive:
    """The same dive with values at the middle of every step; counts are 1 where samples are near, else 0."""
    samples = {name: _samples(dive, number) for number, name in enumerate(SENSORS)}
    if not len(samples["velocity"][0]) and len(samples["position"][0]) and len(samples["attitude"][0]):
        samples["velocity"] = _velocity_of_pose(*samples["position"], *samples["attitude"])
    if not len(samples["rates"][0]) and len(samples["attitude"][0]):
        samples["rates"] = _rates_of_attitude(*samples["attitude"])
    middles = np.arange(len(dive.inputs)) + 0.5
    values, near = [], []
    for name in SENSORS:
        time, rows = samples[name]
        values.append(_interpolated(middles, time, rows, COLUMNS[name]))
        near.append(_is_near(middles, time, _LONGEST_GAP / dive.step))
    joined = np.concatenate(values, axis=1)
    norm = np.linalg.norm(joined[:, 3:7], axis=1, keepdims=True)
    joined[:, 3:7] = np.where(norm > 0, joined[:, 3:7] / np.maximum(norm, 1e-12), (1.0, 0.0, 0.0, 0.0))
    # Times are steps here: velocities made of differences are per step.
    for name, columns in (("velocity", slice(7, 10)), ("rates", slice(10, 13))):
        if not dive.counts[:, SENSORS.index(name)].any():
            joined[:, columns] /= dive.step
    counts = np.stack(near, axis=1).astype(int)
    return dive._replace(
        values=joined, offsets=np.full(counts.shape, 0.5), spreads=np.zeros(counts.shape), counts=counts
    )


def usable_axes(complete: np.ndarray) -> np.ndarray:
    """Whether the equation of each axis can be used, (..., 6), given which sensors are there, (..., 5).

    The equations of turns are used without linear velocities, too, although these add to the moments of roll and pitch:
    a rough estimate is better than none.
    """
    _, attitude, velocity, rates, _ = np.moveaxis(complete, -1, 0)
    of_axis = {axis: velocity for axis in BODY_AXES[:3]} | {axis: rates for axis in BODY_AXES[3:]}
    of_axis |= {axis: rates & attitude for axis in ("roll", "pitch")}
    return np.stack([of_axis[axis] for axis in BODY_AXES], axis=-1)


def _samples(dive: Dive, sensor: int) -> tuple[np.ndarray, np.ndarray]:
    """Times in steps, and values, of the steps in which a sensor has samples."""
    first = sum(list(COLUMNS.values())[:sensor])
    measured = np.flatnonzero(dive.counts[:, sensor])
    columns = slice(first, first + list(COLUMNS.values())[sensor])
    return measured + dive.offsets[measured, sensor], dive.values[measured, columns]


def _interpolated(middles: np.ndarray, time: np.ndarray, rows: np.ndarray, columns: int) -> np.ndarray:
    if not len(time):
        return np.zeros((len(middles), columns))
    return np.stack([np.interp(middles, time, column) for column in rows.T], axis=1)


def _is_near(middles: np.ndarray, time: np.ndarray, longest: float) -> np.ndarray:
    """Whether the samples before and after each time are not far apart."""
    if not len(time):
        return np.zeros(len(middles), dtype=bool)
    after = np.searchsorted(time, middles).clip(0, len(time) - 1)
    before = (np.searchsorted(time, middles) - 1).clip(0)
    until_end = np.maximum(middles - time[-1], time[0] - middles)
    return (time[after] - time[before] <= longest) & (until_end <= 1.0)


def _rates_of_attitude(time: np.ndarray, quaternions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turns between samples over the time between them, body axes, at the middle of both."""
    attitude = Rotation.from_quat(quaternions, scalar_first=True)
    turns = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return (time[1:] + time[:-1]) / 2, turns / np.diff(time)[:, None]


def _velocity_of_pose(
    time: np.ndarray, positions: np.ndarray, attitude_time: np.ndarray, quaternions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Differences of positions in body axes, at the middle of both samples."""
    middle = (time[1:] + time[:-1]) / 2
    attitude = Rotation.from_quat(_interpolated(middle, attitude_time, quaternions, 4), scalar_first=True)
    velocity = np.diff(positions, axis=0) / np.diff(time)[:, None]
    return middle, attitude.inv().apply(velocity)
