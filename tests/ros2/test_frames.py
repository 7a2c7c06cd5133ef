"""Conversions of axes: known poses, rotation matrices, SciPy, and the package's own rotations."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from undertow.core.numerics.rotations import (
    Kinematics,
    euler_from_rotation,
    quaternion_from_euler,
    rotation_from_quaternion,
)
from undertow.logs.frames import attitudes_of_quaternions, quaternions
from undertow.outside.ros2 import frames

pytestmark = pytest.mark.interop

WORLD = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])  # NED -> ENU
BODY = np.diag([1, -1, -1])  # FRD -> FLU


@pytest.fixture
def chance():
    return np.random.default_rng(5)


def test_world_and_body_axes(chance):
    vectors = chance.normal(size=(100, 3))
    np.testing.assert_array_equal(frames.between_ned_and_enu(vectors), vectors @ WORLD.T)
    np.testing.assert_array_equal(frames.between_frd_and_flu(vectors), vectors @ BODY)
    np.testing.assert_array_equal(frames.between_ned_and_enu([1, 2, 3]), [2, 1, -3])
    np.testing.assert_array_equal(frames.between_frd_and_flu([1, 2, 3]), [1, -2, -3])
    for conversion in (frames.between_ned_and_enu, frames.between_frd_and_flu):
        np.testing.assert_array_equal(conversion(conversion(vectors)), vectors)


def test_an_attitude_is_one_rotation_in_either_axes(chance):
    """R of FLU in ENU is P R F; SciPy makes the matrices."""
    quaternions = chance.normal(size=(200, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    ours = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    theirs = Rotation.from_quat(frames.between_attitudes(quaternions), scalar_first=True).as_matrix()
    np.testing.assert_allclose(theirs, WORLD @ ours @ BODY, atol=1e-14)
    np.testing.assert_allclose(frames.between_attitudes(frames.between_attitudes(quaternions)), quaternions, atol=4e-16)


@pytest.mark.parametrize(
    "heading, yaw", [(0, np.pi / 2), (np.pi / 2, 0), (np.pi, -np.pi / 2), (-np.pi / 2, np.pi), (0.3, np.pi / 2 - 0.3)]
)
def test_yaw_counts_from_east_and_to_the_left(heading, yaw):
    """REP 103: a vehicle that points east has yaw zero."""
    quaternion = frames.between_attitudes(quaternions([0, 0, heading]))
    found = Rotation.from_quat(quaternion, scalar_first=True).as_euler("ZYX")
    assert abs(np.exp(1j * found[0]) - np.exp(1j * yaw)) < 1e-15 and np.abs(found[1:]).max() < 1e-15


def test_roll_is_the_same_and_pitch_turns_round():
    """Port, the axis of pitch here, is against starboard; forward, that of roll, is the same."""
    quaternion = frames.between_attitudes(quaternions([0.2, 0.1, 0.0]))
    yaw, pitch, roll = Rotation.from_quat(quaternion, scalar_first=True).as_euler("ZYX")
    np.testing.assert_allclose([roll, pitch, yaw], [0.2, -0.1, np.pi / 2], atol=1e-15)


def test_euler_angles_are_those_of_the_package(chance):
    angles = chance.uniform([-3, -1.5, -3], [3, 1.5, 3], (100, 3))
    found = quaternions(angles)
    expected = np.array([quaternion_from_euler(jnp.asarray(one)) for one in angles])
    np.testing.assert_allclose(found, expected, atol=1e-15)
    np.testing.assert_allclose(attitudes_of_quaternions(found, "NED", "FRD"), angles, atol=1e-12)
    back = [euler_from_rotation(rotation_from_quaternion(jnp.asarray(one))) for one in found]
    np.testing.assert_allclose(attitudes_of_quaternions(found, "NED", "FRD"), back, atol=1e-12)


def test_body_velocity_is_that_of_the_package(chance):
    angles, rates = chance.uniform([-3, -1.4, -3], [3, 1.4, 3], (100, 3)), chance.normal(size=(100, 6))
    expected = [
        Kinematics(rotation_from_quaternion(quaternion_from_euler(jnp.asarray(one)))).to_body(jnp.asarray(moving))
        for one, moving in zip(angles, rates, strict=True)
    ]
    np.testing.assert_allclose(frames.body_velocity_of_rates(angles, rates), expected, atol=1e-13)
