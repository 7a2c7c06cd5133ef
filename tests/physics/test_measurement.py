"""A measured body: pose and outputs say the same, and what works in body axes works at any pitch."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.core.measurement import completed, measurement_of_outputs, measurement_of_pose, with_outputs
from undertow.numerics.rotations import (
    quaternion_from_euler,
    quaternion_rate,
    rotation_from_quaternion,
    turning_from_euler,
)
from undertow.plants.hybrid_model import BodyCoordinates

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
    for _ in range(20):
        y = measurement_of_outputs(*somewhere())
        alike(measurement_of_pose(y.position[:3], y.body.attitude, y.body.nu), y, 1e-10)


def test_turning_is_the_derivative_of_the_attitude():
    """Body rates by the quaternion's kinematics, their rate by automatic differentiation; pitch passes 90 degrees."""
    way = lambda t: jnp.stack([0.7 * jnp.sin(2 * t), 1.1 + t, 0.4 - 0.9 * t**2])
    rate = jax.jacfwd(way)
    found = lambda t: turning_from_euler(way(t), rate(t), jax.jacfwd(rate)(t))

    @jax.jit
    def both(t):
        by_quaternion = jax.jacfwd(lambda t: quaternion_from_euler(way(t)))(t)
        return found(t), by_quaternion, jax.jacfwd(lambda t: found(t)[1])(t)

    for t in (0.0, 0.3, float(np.pi / 2 - 1.1), 0.9):
        (attitude, omega, turning), by_quaternion, omega_rate = both(t)
        np.testing.assert_allclose(attitude, quaternion_from_euler(way(t)), atol=1e-15)
        np.testing.assert_allclose(quaternion_rate(attitude, omega), by_quaternion, atol=1e-12)
        np.testing.assert_allclose(turning, omega_rate, atol=1e-12)


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2])
def test_body_axes_know_no_vertical(pitch):
    """Nose up or down, a vehicle that is on target has no error, and a lead of 1 m world is 1 m in its own axes."""
    attitude, nu = quaternion_from_euler(jnp.array([0.2, pitch, -0.7])), jnp.asarray(RNG.normal(size=6))
    y = measurement_of_pose(jnp.array([1.0, 2.0, 3.0]), attitude, nu)
    lead = jnp.array([0.0, 1.0, 0.0])
    world = rotation_from_quaternion(attitude) @ nu[:3]
    still = jnp.zeros(3)
    r = Target(
        jnp.concatenate([y.position[:3] + lead, jnp.array([0.2, pitch, -0.7])]),
        jnp.concatenate([world, still]),
        jnp.zeros(6),
    )
    error, rate, acceleration = BodyCoordinates().tracking_error(y, r)
    np.testing.assert_allclose(error[:3], rotation_from_quaternion(attitude).T @ lead, atol=1e-14)
    np.testing.assert_allclose(error[3:], 0, atol=1e-14)
    np.testing.assert_allclose(rate, jnp.concatenate([still, -nu[3:]]), atol=1e-14)
    np.testing.assert_allclose(acceleration[:3], -np.cross(nu[3:], nu[:3]), atol=1e-13)
    assert np.isfinite(acceleration).all()


def test_noise_on_outputs_reaches_the_pose():
    """Whichever way a navigation filter changes the outputs of the truth."""
    (eta, rate), (other, faster) = somewhere(), somewhere()
    truth, expected = measurement_of_outputs(eta, rate), measurement_of_outputs(other, faster)
    alike(with_outputs(truth, other, faster), expected)
    alike(completed(truth._replace(position=other, velocity=faster), truth), expected)
    alike(completed(Measurement(other, faster), truth), expected)
    assert completed(truth, truth) is truth
    assert completed(expected, truth) is expected


def test_outputs_alone_are_refused_in_body_axes():
    with pytest.raises(BadInput, match="`measurement` must hold the pose of a body, but is 6 outputs alone"):
        BodyCoordinates().velocity(Measurement(jnp.zeros(6), jnp.zeros(6)))
