"""How the motors of ArduSub's frames push a vehicle, and which of them are the thrusters of one."""

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.errors import BadInput

# How each motor of an ArduSub frame pushes the vehicle at a pulse above neutral: roll, pitch, yaw, up, forward, right.
# Factors of ArduPilot libraries/AP_Motors/AP_Motors6DOF.cpp@0fd5fbf; motor n is on servo output n.
_HORIZONTAL = ((0, 0, 1, 0, -1, 1), (0, 0, -1, 0, -1, -1), (0, 0, -1, 0, 1, 1), (0, 0, 1, 0, 1, -1))
FRAMES = {
    "vectored_6dof": (
        *_HORIZONTAL,
        (1, -1, 0, -1, 0, 0),
        (-1, -1, 0, -1, 0, 0),
        (1, 1, 0, -1, 0, 0),
        (-1, 1, 0, -1, 0, 0),
    ),
    "vectored": (*_HORIZONTAL, (1, 0, 0, -1, 0, 0), (-1, 0, 0, -1, 0, 0)),
}

# Rows of a thruster matrix (surge, sway, heave, roll, pitch, yaw) in the order of those factors; heave is down.
_ROWS, _SIGNS = [3, 4, 5, 2, 0, 1], np.array([1, 1, 1, -1, 1, 1])

_FORCES = slice(3, 6)

_SMALL = 1e-6  # share of the largest entry of a column below which an entry of a thruster matrix is zero


def motors_of_thrusters(frame: str, thruster_matrix: ArrayLike, hint: str) -> tuple[NDArray, NDArray]:
    """Motor, from 1, of each thruster of a vehicle, and -1 where it pushes against the thruster's direction, else 1.

    The thrusters may be in any order and direction: each is the motor that pushes as it does in every axis that the
    motor acts on.

    Args:
        frame: one of FRAMES.
        thruster_matrix: force and moment per newton of each thruster, (6, N), body axes forward, starboard, down.
        hint: what a user whose vehicle has other thrusters may do.

    Raises:
        BadInput: there is no such frame, or its motors are not the thrusters of the vehicle.
    """
    checks.choice("frame", frame, tuple(FRAMES))
    pushes = np.asarray(thruster_matrix, dtype=float)[_ROWS].T * _SIGNS
    pushes = np.sign(np.where(np.abs(pushes) > _SMALL * np.abs(pushes).max(axis=1, keepdims=True), pushes, 0.0))
    motors = [_motor(push, np.array(FRAMES[frame])) for push in pushes]
    numbers = [number for number, _ in motors]
    if len(motors) != len(FRAMES[frame]) or sorted(numbers) != list(range(1, len(motors) + 1)):
        names = ", ".join(str(number or "none") for number in numbers)
        raise BadInput(
            "frame", "have the thrusters of the vehicle", f"{frame}: thrusters are motors {names}", hint=hint
        )
    return np.array(numbers), np.array([sign for _, sign in motors])


def motor_columns(frame: str) -> tuple[str, ...]:
    """Names of the columns of a signal that has one per motor of a frame."""
    return tuple(f"motor {number} of {frame}" for number in range(1, len(FRAMES[frame]) + 1))


def frame_of_columns(columns: tuple[str, ...]) -> str:
    """The frame whose motors the columns of a signal are, by their names; "" for those of other signals."""
    first = re.fullmatch(r"motor 1 of (\w+)", columns[0] if columns else "")
    return first[1] if first and first[1] in FRAMES and columns == motor_columns(first[1]) else ""


def _motor(push: NDArray, motors: NDArray) -> tuple[int, int]:
    """Number, from 1, of the motor that pushes in the same directions, and the sign; (0, 1) where there is none.

    Forces are in the same axes; moments may be more, such as the pitch of a thruster that is mounted low.
    """
    for number, motor in enumerate(motors, start=1):
        acts = motor != 0
        for sign in (1, -1):
            if (push[acts] == sign * motor[acts]).all() and not push[_FORCES][~acts[_FORCES]].any():
                return number, sign
    return 0, 1
