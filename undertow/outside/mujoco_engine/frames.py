"""Axes: north, east, down and forward, starboard, down here; z up in MuJoCo. Both turn by half a turn about x.

MuJoCo's world is then north, west, up and its body forward, port, up. Generalised velocities of its free joint are
the velocity of the body origin in world axes and the angular velocity in body axes; Euler angles are roll, pitch,
yaw of Fossen (2021), ch. 2.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FLIP = np.diag([1.0, -1.0, -1.0])  # its own inverse

# Half a turn about x takes the quaternion (w, x, y, z) of a rotation to (w, x, -y, -z).
_FLIP_QUATERNION = np.array([1.0, 1.0, -1.0, -1.0])


def flip(vectors: ArrayLike) -> NDArray:
    """Vectors, one per row, between the two sets of axes."""
    return np.asarray(vectors, dtype=float) @ FLIP


def flip_tensor(tensor: ArrayLike) -> NDArray:
    """Inertia or rotation between the two sets of axes."""
    return FLIP @ np.asarray(tensor, dtype=float) @ FLIP


def joint_position(position: ArrayLike) -> NDArray:
    """(north, east, down, roll, pitch, yaw) -> the seven numbers of MuJoCo's free joint."""
    pose = np.asarray(position, dtype=float)
    (sr, sp, sy), (cr, cp, cy) = np.sin(pose[3:] / 2), np.cos(pose[3:] / 2)
    roll, pitch, yaw = np.array([cr, sr, 0, 0]), np.array([cp, 0, sp, 0]), np.array([cy, 0, 0, sy])
    return np.concatenate([flip(pose[:3]), _FLIP_QUATERNION * _product(yaw, _product(pitch, roll))])


def euler_angles(rotation: NDArray) -> NDArray:
    """(roll, pitch, yaw), rad, of a rotation body -> world in north, east, down."""
    level = np.hypot(rotation[2, 1], rotation[2, 2])
    tops = rotation[2, 1], -rotation[2, 0], rotation[1, 0]
    return np.arctan2(tops, (rotation[2, 2], level, rotation[0, 0]))


def output_rates(rotation: NDArray, nu: NDArray) -> NDArray:
    """Rates of (north, east, down, roll, pitch, yaw), m/s and rad/s, at body velocity nu."""
    roll, pitch, _ = euler_angles(rotation)
    p, q, r = nu[3:]
    across = q * np.sin(roll) + r * np.cos(roll)
    angles = [p + across * np.tan(pitch), q * np.cos(roll) - r * np.sin(roll), across / np.cos(pitch)]
    return np.concatenate([rotation @ nu[:3], angles])


def velocity_map(rotation: NDArray) -> NDArray:
    """T with nu = T qvel; its transpose takes wrenches at the body origin to generalised forces.

    Args:
        rotation: body -> world in north, east, down.
    """
    to_body = np.zeros((6, 6))
    to_body[:3, :3] = rotation.T @ FLIP
    to_body[3:, 3:] = FLIP
    return to_body


def cross(a: NDArray, b: NDArray) -> NDArray:
    """a x b of three numbers each; np.cross, made for stacks, takes eight times as long."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def _product(a: NDArray, b: NDArray) -> NDArray:
    """Product of two quaternions (w, x, y, z)."""
    vector = a[0] * b[1:] + b[0] * a[1:] + cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], vector])
