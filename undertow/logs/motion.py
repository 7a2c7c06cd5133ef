"""The motion of a vehicle and the input of its thrusters, from whichever signals a log has them in."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from undertow.core.errors import BadInput
from undertow.logs import frames
from undertow.logs.ardusub_frames import frame_of_columns, motors_of_thrusters
from undertow.logs.default_mappings import DEFAULTS
from undertow.logs.known_signals import thruster_columns
from undertow.logs.log_signals import LogSignals, Series, mapping_hint, missing

_INPUTS = ("commanded_input", "input")
_COMMANDS = {"pulses": "us", "duty": "1"}  # to speed controllers, and the unit that makes an input of them


class LoggedMotion(NamedTuple):
    """Motion of a vehicle.

    Attributes:
        time: s, shape (rows,).
        outputs: north, east, down (m), roll, pitch, yaw (rad, without jumps of a turn), shape (rows, 6).
        nu: surge, sway, heave (m/s), p, q, r (rad/s), shape (rows, 6).
    """

    time: np.ndarray
    outputs: np.ndarray
    nu: np.ndarray


def inputs_of(log: LogSignals, names: tuple[str, ...] = _INPUTS, thruster_matrix: ArrayLike | None = None) -> Series:
    """The input of the thrusters: the first of the named signals that the log has.

    Args:
        log: with the inputs.
        names: of the signals that will do.
        thruster_matrix: of the vehicle, (6, N), body axes; by it the motors of a frame of ArduSub become its thrusters.

    Raises:
        BadInput: it has none of them, or not enough samples; or the motors are not the thrusters of the vehicle.
    """
    inputs = next((log[name] for name in names if name in log), None)
    if inputs is None:
        raise missing(log, *names, hint=_input_hint(log))
    is_finite = np.isfinite(inputs.values).all(axis=1)
    if is_finite.sum() < 2:
        raise BadInput("log", "have two or more samples of the input", f"{log.source} with {int(is_finite.sum())}")
    inputs = inputs._replace(time=inputs.time[is_finite], values=inputs.values[is_finite])
    frame = frame_of_columns(inputs.columns)
    return inputs if not frame else _of_thrusters(inputs, frame, thruster_matrix)


def _of_thrusters(inputs: Series, frame: str, thruster_matrix: ArrayLike | None) -> Series:
    """Inputs of the motors of a frame as those of the thrusters of a vehicle, in their order and direction."""
    hint = "Map the column of each thruster instead, negative where it turns the other way: `columns: [C1, -C2, ...]`"
    if thruster_matrix is None:
        raise BadInput("plant", f"be a vehicle whose thrusters are the motors of {frame}", "another plant", hint=hint)
    motors, signs = motors_of_thrusters(frame, thruster_matrix, hint)
    return inputs._replace(values=signs * inputs.values[:, motors - 1], columns=thruster_columns(len(motors)))


def _input_hint(log: LogSignals) -> str:
    """How to map an input: from the commands to speed controllers that the log has, or else from pulses by example."""
    commands = next((name for name in _COMMANDS if name in log), "pulses")
    if log.format in ("ArduPilot", "MAVLink"):
        example = mapping_hint(log, "input", "", "frame: vectored_6dof, unit: us, supply: 16")
        return f"{example}, with the frame of the vehicle (FRAME_CONFIG); `supply` is in V"
    usual = DEFAULTS[log.format].signals.get(commands) if log.format in DEFAULTS else None
    columns, topic = (usual[0].columns, usual[0].topic) if usual else (("pwm1", "pwm2"), "TOPIC")
    unit_and_supply = f"unit: {_COMMANDS[commands]}, supply: 16"
    example = mapping_hint(log, "input", f"{columns[0]}, {columns[1]}, ...", unit_and_supply, topic)
    return f"{example}, one column per thruster; `supply` is in V"


def motion_of(log: LogSignals) -> LoggedMotion:
    """The motion at the times of the position, between the first and last samples of all signals that it is made of.

    Other signals are interpolated linearly to these times.

    Raises:
        BadInput: position, attitude or a velocity is missing, or they do not overlap.
    """
    position = log["measured_position" if "position" not in log and "measured_position" in log else "position"]
    is_pose = position.values.shape[1:] == (6,)
    attitude = position._replace(values=position.values[:, 3:]) if is_pose else log["attitude"]
    turning = attitude._replace(values=without_jumps(attitude.values))
    velocity, rates = _velocities(log)
    signals = [position, turning, velocity, rates]
    start = max(series.time[0] for series in signals if len(series.time))
    end = min(series.time[-1] for series in signals if len(series.time))
    in_common = (position.time >= start) & (position.time <= end) & np.isfinite(position.values).all(axis=1)
    time = position.time[in_common]
    if len(time) < 2:
        raise BadInput("log", "have position, attitude and velocities of the same times", log.source)
    angles = at_times(time, turning)
    north_east_down = position.values[in_common, :3]
    linear = at_times(time, velocity)
    if velocity.columns[:3] == ("north", "east", "down"):  # world axes
        linear = np.einsum("kij,ki->kj", frames.rotations(angles), linear[:, :3])
    angular = at_times(time, rates)
    if rates.values.shape[1] == 6:  # rates of the Euler angles
        angular = frames.angular_velocity_of_rates(angles, angular[:, 3:])
    return LoggedMotion(time, np.hstack([north_east_down, angles]), np.hstack([linear, angular]))


def _velocities(log: LogSignals) -> tuple[Series, Series]:
    """Linear and angular velocity, in the forms in which the log has them."""
    for name in ("velocity", "measured_velocity"):
        if name in log and log[name].values.shape[1:] == (6,):
            return log[name], log[name]
    linear = log["body_velocity"] if "body_velocity" in log else log["velocity"]
    return linear, log["angular_velocity"]


def without_jumps(angles: np.ndarray) -> np.ndarray:
    """Angles without jumps of a turn; rows that are not finite stay."""
    unwrapped = angles.copy()
    is_finite = np.isfinite(angles).all(axis=1)
    unwrapped[is_finite] = np.unwrap(angles[is_finite], axis=0)
    return unwrapped


def at_times(time: np.ndarray, series: Series) -> np.ndarray:
    """Values at other times, linear between samples that are finite; the samples themselves at their times."""
    is_finite = np.isfinite(series.values).all(axis=1)
    sample_times, values = series.time[is_finite], series.values[is_finite]
    if not len(sample_times):
        return np.full((len(time), series.values.shape[1]), np.nan)
    return np.stack([np.interp(time, sample_times, column) for column in values.T], axis=1)
