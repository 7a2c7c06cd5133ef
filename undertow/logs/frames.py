"""Conversions of logged vectors and attitudes into our frames, in NumPy, a row per sample.

ENU: x east, y north, z up; FLU: x forward, y left (port), z up, as of ROS (REP 103). Each is its own inverse.
"""

import numpy as np
from numpy.typing import ArrayLike

# Rows: our axes; columns: those of the log.
_OF_WORLD = {"NED": np.eye(3), "ENU": np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])}
_OF_BODY = {"FRD": np.eye(3), "FLU": np.diag([1.0, -1, -1])}


def world_vectors(vectors: np.ndarray, world: str) -> np.ndarray:
    """Vectors in north, east, down from those in NED or ENU axes, shape (rows, 3)."""
    return vectors if world == "NED" else vectors @ _OF_WORLD[world].T


def body_vectors(vectors: np.ndarray, body: str) -> np.ndarray:
    """Vectors in forward, starboard, down from those in FRD or FLU axes, shape (rows, 3)."""
    return vectors if body == "FRD" else vectors @ _OF_BODY[body].T


def attitudes(angles: np.ndarray, world: str, body: str) -> np.ndarray:
    """Roll, pitch, yaw (rad) of FRD in NED from those of a body in a world of other axes, shape (rows, 3)."""
    if (world, body) == ("NED", "FRD"):
        return angles
    return euler_angles(_OF_WORLD[world] @ rotations(angles) @ _OF_BODY[body].T)


def attitudes_of_quaternions(quaternions: np.ndarray, world: str, body: str) -> np.ndarray:
    """Roll, pitch, yaw (rad) of FRD in NED from quaternions (w, x, y, z), body to world, of any finite length."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        length = np.linalg.norm(quaternions, axis=1, keepdims=True)
        w, x, y, z = (quaternions / np.where(np.isfinite(length), length, np.nan)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    rotation = np.moveaxis(np.array(rows), -1, 0)
    return euler_angles(_OF_WORLD[world] @ rotation @ _OF_BODY[body].T)


_VERTICAL = 1e-9  # cosine of a pitch that counts as 90 degrees


def rotations(angles: np.ndarray) -> np.ndarray:
    """Rotations body -> world of roll, pitch, yaw (rad), shape (rows, 3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles).T, np.cos(angles).T
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def euler_angles(rotation: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw (rad) of rotations body -> world, shape (rows, 3)."""
    level = np.hypot(rotation[:, 2, 1], rotation[:, 2, 2])
    upright = level < _VERTICAL  # then only the sum or difference of roll and yaw is there: roll is zero
    roll = np.where(upright, 0.0, np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2]))
    pitch = np.arctan2(-rotation[:, 2, 0], level)
    yaw = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    yaw = np.where(upright, np.arctan2(-rotation[:, 0, 1], rotation[:, 1, 1]), yaw)
    return np.stack([roll, pitch, yaw], axis=1)


def quaternions(angles: ArrayLike) -> np.ndarray:
    """Unit quaternions (w, x, y, z), body to world, of roll, pitch, yaw (rad) along the last axis."""
    halves = np.moveaxis(np.asarray(angles, dtype=float), -1, 0) / 2
    (sr, sp, sy), (cr, cp, cy) = np.sin(halves), np.cos(halves)
    w = cr * cp * cy + sr * sp * sy
    x = sr * cp * cy - cr * sp * sy
    y = cr * sp * cy + sr * cp * sy
    z = cr * cp * sy - sr * sp * cy
    return np.stack([w, x, y, z], axis=-1)


def angular_velocity_of_rates(angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """p, q, r (rad/s) of rates of roll, pitch, yaw (rad/s), shape (rows, 3). Fossen (2021), Eq. (2.26)."""
    (sr, sp, _), (cr, cp, _) = np.sin(angles).T, np.cos(angles).T
    roll, pitch, yaw = rates.T
    return np.stack([roll - sp * yaw, cr * pitch + cp * sr * yaw, cp * cr * yaw - sr * pitch], axis=1)
