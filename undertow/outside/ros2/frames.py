"""Axes: north, east, down and forward, starboard, down inside; east, north, up and forward, port, up in ROS (REP 103).

Each conversion is its own inverse. Those of vectors exchange entries and signs, so that they are exact; the one of
quaternions rounds, by two units in the last place.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

_HALF_ROOT = np.sqrt(0.5)


def between_ned_and_enu(vector: ArrayLike) -> NDArray:
    """A vector in world axes, or several along the last axis: (north, east, down) <-> (east, north, up)."""
    north, east, down = np.moveaxis(np.asarray(vector, dtype=float), -1, 0)
    return np.stack([east, north, -down], axis=-1)


def between_frd_and_flu(vector: ArrayLike) -> NDArray:
    """A vector in body axes, or several along the last axis: (forward, starboard, down) <-> (forward, port, up).

    Velocities, angular velocities, forces and moments alike.
    """
    forward, starboard, down = np.moveaxis(np.asarray(vector, dtype=float), -1, 0)
    return np.stack([forward, -starboard, -down], axis=-1)


def between_attitudes(quaternion: ArrayLike) -> NDArray:
    """A quaternion (w, x, y, z) body -> world, or several: from FRD to NED <-> from FLU to ENU.

    The product of half a turn about (1, 1, 0), the quaternion, and half a turn about (1, 0, 0); the sign is the one
    with which a vehicle that points north has yaw pi/2 in ENU.
    """
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    return _HALF_ROOT * np.stack([w + z, x + y, x - y, w - z], axis=-1)


def body_velocity_of_rates(angles: ArrayLike, rates: ArrayLike) -> NDArray:
    """(u, v, w, p, q, r) of the rates of (north, east, down, roll, pitch, yaw) at roll, pitch, yaw; m/s and rad/s.

    Fossen (2021), Eqs. (2.18) and (2.26).
    """
    (roll, pitch, yaw), moving = (np.moveaxis(np.asarray(array, dtype=float), -1, 0) for array in (angles, rates))
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    north, east, down, roll_rate, pitch_rate, yaw_rate = moving
    forward = cy * north + sy * east
    across = cy * east - sy * north
    lower = sp * forward + cp * down
    linear = cp * forward - sp * down, cr * across + sr * lower, cr * lower - sr * across
    turning = roll_rate - sp * yaw_rate, cr * pitch_rate + sr * cp * yaw_rate, cr * cp * yaw_rate - sr * pitch_rate
    return np.stack([*linear, *turning], axis=-1)
