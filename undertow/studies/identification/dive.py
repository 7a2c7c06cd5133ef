"""A log on a grid of equal steps: inputs averaged over each step, and what each sensor measured in it.

Samples keep their own times: a step holds the mean of those of a sensor that fall into it, at their mean time.
"""

from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs import frames
from undertow.logs.log_signals import LogSignals, Series
from undertow.logs.motion import at_times, without_jumps
from undertow.studies.identification.outliers import outliers

# What is compared with the model: sensor -> columns of `Dive.values`, and of the residuals, in which an attitude has
# three numbers instead of four.
SENSORS = ("position", "attitude", "velocity", "rates", "depth")
COLUMNS = {"position": 3, "attitude": 4, "velocity": 3, "rates": 3, "depth": 1}
RESIDUALS = ("north", "east", "down", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r", "depth")
RESIDUAL_UNITS = ("m",) * 3 + ("rad",) * 3 + ("m/s",) * 3 + ("rad/s",) * 3 + ("m",)
SENSOR_OF_RESIDUAL = np.repeat(np.arange(5), (3, 3, 3, 3, 1))

_AT_LEAST = 20  # samples of a sensor, below which it is taken as not there


class Dive(NamedTuple):
    """A log on a grid.

    Attributes:
        name: of the file.
        start: time of the log at the first step, s.
        step: s.
        inputs: mean over each step, shape (steps, N).
        values: position (m), quaternion, body velocity (m/s), body rates (rad/s), depth (m), shape (steps, 14).
        offsets: mean time of the samples after the begin of the step, as a share of it, shape (steps, 5).
        spreads: variance of these times, in squares of a step, shape (steps, 5).
        counts: samples of each sensor, shape (steps, 5).
    """

    name: str
    start: float
    step: float
    inputs: np.ndarray
    values: np.ndarray
    offsets: np.ndarray
    spreads: np.ndarray
    counts: np.ndarray

    @property
    def duration(self) -> float:
        """In s."""
        return self.step * len(self.inputs)

    def part(self, name: str, first: int, steps: int) -> "Dive":
        """Some of its steps."""
        rows = slice(first, first + steps)
        arrays = (self.inputs, self.values, self.offsets, self.spreads, self.counts)
        return Dive(name, self.start + first * self.step, self.step, *(array[rows] for array in arrays))

    def sensors(self) -> list[str]:
        """Sensors with samples."""
        return [name for name, count in zip(SENSORS, self.counts.sum(axis=0), strict=True) if count]


def dive_of(log: LogSignals, inputs: Series, step: float) -> Dive:
    """A log on a grid, over the time in which it has inputs and measurements; without outliers.

    Args:
        log: with some of position or depth, attitude, velocity, angular velocity.
        inputs: of the thrusters or axes, each held until the next.
        step: s.

    Raises:
        BadInput: nothing of the motion was measured, or not together with the inputs.
    """
    measured = measured_by(log)
    if not measured:
        raise BadInput("log", "have an attitude, a velocity or an angular velocity", log.source)
    start = max(inputs.time[0], min(time[0] for time, _ in measured.values()))
    end = max(time[-1] for time, _ in measured.values())
    # Steps begin where inputs jump: thrust is no linear function of them, so that a mean over a jump is another thrust.
    start = inputs.time[min(np.searchsorted(inputs.time, start), len(inputs.time) - 1)]
    steps = int((end - start) / step)
    if steps < 2:
        raise BadInput("log", "have inputs and a motion at the same time", log.source)
    values, offsets, spreads, counts = [], [], [], []
    for name in SENSORS:
        time, samples = measured.get(name, (np.zeros(0), np.zeros((0, COLUMNS[name]))))
        if len(samples) >= _AT_LEAST:
            good = ~outliers(samples)
            time, samples = time[good], samples[good]
        mean, offset, spread, count = _in_steps(time, samples, start, step, steps)
        values.append(mean)
        offsets.append(offset)
        spreads.append(spread)
        counts.append(count)
    means = np.concatenate(values, axis=1)
    means[:, 3:7] /= np.maximum(np.linalg.norm(means[:, 3:7], axis=1, keepdims=True), 1e-12)
    means[counts[1] == 0, 3:7] = (1.0, 0.0, 0.0, 0.0)
    grid = start + step * np.arange(steps + 1)
    return Dive(
        name=log.source,
        start=float(start),
        step=step,
        inputs=_averaged(inputs, grid),
        values=means,
        offsets=np.stack(offsets, axis=1),
        spreads=np.stack(spreads, axis=1),
        counts=np.stack(counts, axis=1),
    )


def measured_by(log: LogSignals) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times and samples of each sensor that a log has."""
    found: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    pose = next((log[name] for name in ("measured_position", "position") if name in log), None)
    attitude = log["attitude"] if "attitude" in log else None
    if pose is not None and pose.values.shape[1:] == (6,):
        attitude = pose._replace(values=pose.values[:, 3:])
    if pose is not None:
        _add(found, "position", pose.time, pose.values[:, :3])
    elif "depth" in log:
        _add(found, "depth", log["depth"].time, log["depth"].flat())
    if attitude is not None:
        angles = attitude._replace(values=without_jumps(attitude.values))
        _add(found, "attitude", attitude.time, _continuous(frames.quaternions(attitude.values)))
        _add_velocities(found, log, angles)
    elif "angular_velocity" in log:
        _add(found, "rates", log["angular_velocity"].time, log["angular_velocity"].values)
    return found


def _add_velocities(found: dict, log: LogSignals, angles: Series) -> None:
    """Body velocity and body rates, from whichever form the log has them in."""
    velocity = next((log[name] for name in ("measured_velocity", "velocity") if name in log), None)
    if "body_velocity" in log:
        _add(found, "velocity", log["body_velocity"].time, log["body_velocity"].values)
    elif velocity is not None:
        rotations = frames.rotations(at_times(velocity.time, angles))
        _add(found, "velocity", velocity.time, np.einsum("kij,ki->kj", rotations, velocity.values[:, :3]))
    if "angular_velocity" in log:
        _add(found, "rates", log["angular_velocity"].time, log["angular_velocity"].values)
    elif velocity is not None and velocity.values.shape[1:] == (6,):
        rates = frames.angular_velocity_of_rates(at_times(velocity.time, angles), velocity.values[:, 3:])
        _add(found, "rates", velocity.time, rates)


def _add(found: dict, name: str, time: np.ndarray, values: np.ndarray) -> None:
    is_finite = np.isfinite(values).all(axis=1)
    if is_finite.sum() >= _AT_LEAST:
        found[name] = (time[is_finite], values[is_finite])


def _continuous(quaternions: np.ndarray) -> np.ndarray:
    """The same attitudes with signs such that each is near the one before."""
    agree = np.sign((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    signs = np.cumprod(np.concatenate([[1.0], np.where(agree < 0, -1.0, 1.0)]))
    return signs[:, None] * quaternions


def _in_steps(time: np.ndarray, samples: np.ndarray, start: float, step: float, steps: int):
    """Means of samples and of their times in each step, variance of these times, and number of samples."""
    position = (time - start) / step
    inside = (position >= 0) & (position < steps)
    position, samples = position[inside], samples[inside]
    index = position.astype(int)
    count = np.bincount(index, minlength=steps)
    divisor = np.maximum(count, 1)
    offset = np.bincount(index, position - index, minlength=steps) / divisor
    spread = np.bincount(index, (position - index - offset[index]) ** 2, minlength=steps) / divisor
    mean = np.stack([np.bincount(index, column, minlength=steps) / divisor for column in samples.T], axis=1)
    return mean, offset, spread, count


def _averaged(inputs: Series, grid: np.ndarray) -> np.ndarray:
    """Mean of inputs that are held from sample to sample, over each step of a grid."""
    values = inputs.flat()
    held = np.diff(inputs.time)[:, None] * values[:-1]
    until_sample = np.vstack([np.zeros(values.shape[1]), np.cumsum(held, axis=0)])
    index = (np.searchsorted(inputs.time, grid, side="right") - 1).clip(0)
    until = until_sample[index] + (grid - inputs.time[index])[:, None] * values[index]
    return np.diff(until, axis=0) / np.diff(grid)[:, None]
