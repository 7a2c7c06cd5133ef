"""A measured body: pose and outputs say the same, and what works in body axes works at any pitch."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs, measurement_of_pose, with_outputs, with_pose
from undertow.core.numerics.rotations import (
    quaternion_from_euler,
    quaternion_rate,
    rotation_from_quaternion,
    turning_from_euler,
)
from undertow.physics.plants.hybrid_model import BodyCoordinates

RNG = np.random.default_rng(16)


def somewhere():
    eta = jnp.asarray(RNG.uniform(-1, 1, 6) * [3, 3, 3, 3.1, 1.5, 3.1])
    return eta, jnp.asarray(RNG.normal(size=6))


def alike(one, other, tolerance=1e-12):
    for name in ("position", "velocity"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=tolerance)
    for name in ("rotation", "nu"):
        np.testing.assert_allclose(getattr(one.body, name), getattr(other.body, name), atol=tolerance)


def test_outputs_and_pose_lead_to_each_other():

    @jax.jit
    def both(eta, rate):
        y = measurement_of_outputs(eta, rate)
        return measurement_of_pose(y.position[:3], y.body.attitude, y.body.nu), y

    for _ in range(20):
        alike(*both(*somewhere()), 1e-10)


def test_turning_is_the_derivative_of_the_attitude():
    """Body rates by the quaternion's kinematics, their rate by automatic differentiation; pitch passes 90 degrees."""
    way = lambda t: np.array([0.7 * np.sin(2 * t), 1.1 + t, 0.4 - 0.9 * t**2])
    rate = lambda t: np.array([1.4 * np.cos(2 * t), 1.0, -1.8 * t])
    bend = lambda t: np.array([-2.8 * np.sin(2 * t), 0.0, -1.8])

    @jax.jit
    def both(angles, rate, bend):
        found = lambda angles, rate: turning_from_euler(angles, rate, bend)
        (attitude, omega, turning), (_, omega_rate, _) = jax.jvp(found, (angles, rate), (rate, bend))
        same, by_quaternion = jax.jvp(quaternion_from_euler, (angles,), (rate,))
        return attitude, turning, same, quaternion_rate(attitude, omega), by_quaternion, omega_rate

    for t in (0.0, 0.3, float(np.pi / 2 - 1.1), 0.9):
        attitude, turning, same, rate_of_attitude, by_quaternion, omega_rate = both(way(t), rate(t), bend(t))
        np.testing.assert_allclose(attitude, same, atol=1e-15)
        np.testing.assert_allclose(rate_of_attitude, by_quaternion, atol=1e-12)
        np.testing.assert_allclose(turning, omega_rate, atol=1e-12)


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2])
def test_body_axes_know_no_vertical(pitch):
    """Nose up or down, a vehicle that is on target has no error, and a lead of 1 m world is 1 m in its own axes."""
    nu, lead = RNG.normal(size=6), np.array([0.0, 1.0, 0.0])
    rotation, (error, rate, acceleration) = jax.tree.map(np.asarray, on_target(pitch, nu, lead))
    np.testing.assert_allclose(error[:3], rotation.T @ lead, atol=1e-14)
    np.testing.assert_allclose(error[3:], 0, atol=1e-14)
    np.testing.assert_allclose(rate, np.concatenate([np.zeros(3), -nu[3:]]), atol=1e-14)
    np.testing.assert_allclose(acceleration[:3], -np.cross(nu[3:], nu[:3]), atol=1e-13)
    assert np.isfinite(acceleration).all()


@jax.jit
def on_target(pitch, nu, lead):
    """Rotation of a vehicle that moves as its target does, which is ahead, and its tracking error."""
    angles = jnp.stack([jnp.asarray(0.2), pitch, jnp.asarray(-0.7)])
    attitude = quaternion_from_euler(angles)
    y, rotation = measurement_of_pose(jnp.array([1.0, 2.0, 3.0]), attitude, nu), rotation_from_quaternion(attitude)
    velocity = jnp.concatenate([rotation @ nu[:3], jnp.zeros(3)])
    r = Target(jnp.concatenate([y.position[:3] + lead, angles]), velocity, jnp.zeros(6))
    return rotation, BodyCoordinates().tracking_error(y, r)


def test_noise_on_outputs_reaches_the_pose():
    """Whichever way a navigation filter changes the outputs of the truth."""
    (eta, rate), (other, faster) = somewhere(), somewhere()
    truth, expected = measurement_of_outputs(eta, rate), measurement_of_outputs(other, faster)
    alike(with_outputs(truth, other, faster), expected)
    alike(with_pose(truth._replace(position=other, velocity=faster), truth), expected)
    alike(with_pose(Measurement(other, faster), truth), expected)
    assert with_pose(truth, truth) is truth
    assert with_pose(expected, truth) is expected


def test_outputs_alone_are_refused_in_body_axes():
    with pytest.raises(BadInput, match="`measurement` must hold the pose of a body, but is 6 outputs alone"):
        BodyCoordinates().velocity(Measurement(jnp.zeros(6), jnp.zeros(6)))
