"""Rotations: round trips, J J^-1 = I, quaternions against Euler angles, and J_dot nu against automatic differentiation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import euler_rate_matrix, jacobian, rotation_from_euler, wrap_angle

from undertow.core.numerics.rotations import (
    _SMALLEST_COSINE,
    Kinematics,
    cross,
    euler_from_rotation,
    quaternion_from_euler,
    quaternion_rate,
    rotation_from_quaternion,
    skew,
)

RNG = np.random.default_rng(7)
COUNT = 500
ANGLES = RNG.uniform(-1.0, 1.0, (COUNT, 3)) * np.array([np.pi, 1.4, np.pi])  # |pitch| < 1.4
RATES = RNG.normal(size=(COUNT, 6))
QUATERNIONS = RNG.normal(size=(COUNT, 4))
QUATERNIONS /= np.linalg.norm(QUATERNIONS, axis=1, keepdims=True)


def each(function):
    return jax.jit(jax.vmap(function))


def elementary(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), multiplied out by NumPy."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


@pytest.mark.full
def test_euler_angles_are_turns_about_z_then_y_then_x():
    expected = np.stack([elementary(*angles) for angles in ANGLES])
    np.testing.assert_allclose(each(rotation_from_euler)(ANGLES), expected, rtol=0, atol=1e-14)


def test_rotations_are_orthogonal_and_right_handed():
    rotations = np.asarray(each(rotation_from_quaternion)(QUATERNIONS))
    np.testing.assert_allclose(rotations @ rotations.swapaxes(1, 2), np.tile(np.eye(3), (COUNT, 1, 1)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-14)


def test_euler_angles_survive_a_round_trip():
    np.testing.assert_allclose(
        each(lambda a: euler_from_rotation(rotation_from_euler(a)))(ANGLES), ANGLES, rtol=0, atol=1e-13
    )


def test_quaternions_survive_a_round_trip_up_to_sign():
    there_and_back = each(lambda q: quaternion_from_euler(euler_from_rotation(rotation_from_quaternion(q))))
    back = np.asarray(there_and_back(QUATERNIONS))
    same_sign = np.sign((back * QUATERNIONS).sum(1, keepdims=True))
    np.testing.assert_allclose(same_sign * back, QUATERNIONS, rtol=0, atol=1e-11)


@pytest.mark.parametrize("sign", [1.0, pytest.param(-1.0, marks=pytest.mark.full)])
def test_quaternion_and_euler_angles_name_the_same_rotation(sign):
    from_quaternion = each(lambda a: rotation_from_quaternion(sign * quaternion_from_euler(a)))(ANGLES)
    np.testing.assert_allclose(from_quaternion, each(rotation_from_euler)(ANGLES), rtol=0, atol=1e-14)


def test_skew_matrix_and_cross_product_agree_with_numpy():
    a, b = RATES[:, :3], RATES[:, 3:]
    for found in each(lambda a, b: (cross(a, b), skew(a) @ b))(a, b):
        np.testing.assert_allclose(found, np.cross(a, b), rtol=0, atol=1e-15)


@pytest.mark.full
def test_wrapped_angle_differs_by_whole_turns_and_lies_in_half_open_range():
    angles = np.concatenate([RNG.uniform(-50, 50, 1000), [np.pi, -np.pi, 0.0]])
    wrapped = np.asarray(wrap_angle(jnp.asarray(angles)))
    assert ((wrapped >= -np.pi) & (wrapped < np.pi)).all()
    turns = (angles - wrapped) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-14)


def test_kinematics_is_the_jacobian_and_its_inverse():
    def compare(angles, nu):
        kinematics, j = Kinematics(rotation_from_euler(angles)), jacobian(angles)
        forward = kinematics.to_world(nu) - j @ nu
        backward = kinematics.to_body(nu) - jnp.linalg.solve(j, nu)
        return forward, backward, kinematics.to_body(kinematics.to_world(nu)) - nu

    for difference in each(compare)(ANGLES, RATES):
        np.testing.assert_allclose(difference, 0.0, atol=1e-12)


@pytest.mark.full
def test_determinant_of_euler_rate_matrix_is_one_over_cosine_of_pitch():
    determinants = each(lambda a: jnp.linalg.det(euler_rate_matrix(a)))(ANGLES)
    np.testing.assert_allclose(determinants, 1 / np.cos(ANGLES[:, 1]), rtol=1e-12)


def test_quaternion_rate_is_what_turns_the_rotation_at_body_rates():
    """R_dot = R S(omega), for the rotation that the quaternion stands for."""

    def rates(q, omega):
        rotation, rate = jax.jvp(rotation_from_quaternion, (q,), (quaternion_rate(q, omega),))
        return rate, rotation @ skew(omega)

    found, expected = each(rates)(QUATERNIONS, RATES[:, :3])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


@pytest.mark.full
def test_quaternion_rate_and_euler_rates_describe_the_same_motion():
    def rates(angles, omega):
        from_euler = jax.jvp(quaternion_from_euler, (angles,), (euler_rate_matrix(angles) @ omega,))[1]
        return from_euler, quaternion_rate(quaternion_from_euler(angles), omega)

    found, expected = each(rates)(ANGLES, RATES[:, :3])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_quaternion_rate_pulls_the_length_back_to_one():
    """d|q|^2/dt = (1 - |q|^2) |q|^2: towards one from either side, never away from it."""
    scales = np.linspace(0.8, 1.2, COUNT)[:, None]
    q = scales * QUATERNIONS
    growth = 2 * (q * np.asarray(each(quaternion_rate)(q, RATES[:, :3]))).sum(1)
    square = scales[:, 0] ** 2
    np.testing.assert_allclose(growth, (1 - square) * square, rtol=0, atol=1e-14)


def test_rate_term_is_the_derivative_of_the_jacobian_times_nu():
    """J_dot nu, the part of Eq. (4) that Remark 2 calls unknown."""

    def both(angles, nu):
        angle_rates = (jacobian(angles) @ nu)[3:]
        expected = jax.jvp(lambda a: jacobian(a) @ nu, (angles,), (angle_rates,))[1]
        found = Kinematics(rotation_from_euler(angles)).rate_term(nu)
        return jnp.linalg.norm(found - expected) / jnp.linalg.norm(expected)

    assert np.asarray(each(both)(ANGLES, RATES)).max() <= 1e-12


def test_upright_the_cosine_of_the_pitch_is_the_smallest_there_is():
    """No rate is divided by zero there, and nowhere else does it count."""
    upright = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    assert float(Kinematics(jnp.asarray(upright)).cos_pitch) == _SMALLEST_COSINE == 1e-12
    level = Kinematics(rotation_from_euler(jnp.array([0.3, 0.5, 0.2])))
    assert float(level.cos_pitch) == pytest.approx(np.cos(0.5), rel=1e-15)
