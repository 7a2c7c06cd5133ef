"""The plant's outputs and accelerations are time derivatives of each other, on every fidelity; and Euler angles would do."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import jacobian

from undertow.core.contracts import Load
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import euler_from_rotation, rotation_from_quaternion
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import odin

RNG = np.random.default_rng(4)
COUNT = 200
POSE = jnp.asarray(RNG.uniform(-1, 1, (COUNT, 6)) * np.array([10, 10, 10, np.pi, 1.3, np.pi]))
VELOCITY, PUSH, WRENCH = (jnp.asarray(scale * RNG.normal(size=(COUNT, 6))) for scale in (1, 1, 30))
VOLTS, NOISE = 10 * RNG.normal(size=(COUNT, 8)), RNG.normal(size=(COUNT, 8))


def close(found, expected):
    difference = np.linalg.norm(np.asarray(found) - np.asarray(expected), axis=1)
    return (difference <= 1e-10 * np.linalg.norm(np.asarray(expected), axis=1)).all()


@pytest.fixture(scope="module", params=["ideal", "electromechanical"])
def pairs(request):
    """Found and expected vectors of the tests below: on the fidelities with and without a prescribed acceleration."""
    plant, t = hybrid_vehicle(odin(), paper_table3(request.param)), jnp.zeros(())
    model, lumped_is_all = plant.model(), request.param == "ideal"

    def compare(pose, velocity, volts, push, wrench, noise):
        x = plant.initial_state(pose, velocity)
        x = x._replace(thrusters=jax.tree.map(lambda leaf: 20 * noise[: leaf.shape[0]], x.thrusters))
        load = Load(push, wrench)
        rates = plant.dynamics(t, x, volts, load)
        y, y_rate = jax.jvp(lambda x: plant.output(t, x)._replace(actuator=None), (x,), (rates,))
        acceleration = plant.acceleration(t, x, volts, load)
        tau = plant.thruster_matrix @ plant.thruster.thrust(x.thrusters, volts) - wrench
        j, j_rate = jax.jvp(jacobian, (pose[3:],), (velocity[3:],))
        prescribed = push if lumped_is_all else push + j_rate @ x.nu
        return {
            "position": (y.position, pose),
            "velocity": (y_rate.position, y.velocity),
            "acceleration": (y_rate.velocity, acceleration),
            "load": (acceleration, model.dynamics.drift(y) + j @ plant.body.inverse_mass_matrix @ tau + prescribed),
        }

    return jax.jit(jax.vmap(compare))(POSE, VELOCITY, VOLTS, PUSH, WRENCH, NOISE)


@pytest.mark.full
@pytest.mark.parametrize("name", ["position", "velocity", "acceleration"])
def test_velocity_and_acceleration_are_time_derivatives_of_the_output(pairs, name):
    assert close(*pairs[name])


@pytest.mark.full
def test_prescribed_acceleration_enters_as_the_benchmark_says(pairs):
    """Added to x_ddot on every fidelity; on `ideal` and `static` it is all of d, J_dot nu included."""
    assert close(*pairs["load"])


def test_double_integrator_is_its_own_derivative():
    plant, t = double_integrator(axes=6), jnp.zeros(())
    x = plant.initial_state(POSE[0], VELOCITY[0])
    rates = plant.dynamics(t, x, VELOCITY[1], Load(PUSH[0], WRENCH[0]))
    np.testing.assert_array_equal(rates.position, VELOCITY[0])
    np.testing.assert_allclose(rates.velocity, VELOCITY[1] + PUSH[0] - WRENCH[0], rtol=1e-15)


def tumble(step, start, steps):
    def body(state, k):
        return (rk4(step, k * 2e-3, state, jnp.asarray(2e-3)), None)

    return jax.jit(lambda start: jax.lax.scan(body, start, jnp.arange(float(steps)))[0])(start)


def moments(t):
    """A smooth wrench that rolls, pitches and yaws the vehicle about without looping it."""
    return jnp.stack(
        [50 * jnp.sin(t), 40 * jnp.cos(0.7 * t), 30 * jnp.sin(1.3 * t)]
        + [40 * jnp.sin(0.5 * t), 25 * jnp.cos(0.9 * t), 20 * jnp.sin(0.3 * t + 1)]
    )


@pytest.mark.full
def test_euler_and_quaternion_plants_agree_for_twenty_seconds():
    """I9; the Euler plant is Eqs. (1), (2) written out here."""
    plant = hybrid_vehicle(odin(), paper_table3("shaft"))
    body = plant.body

    def in_euler_angles(t, state):
        eta, nu, _ = state
        j = jacobian(eta[3:])
        forces = moments(t) - body.coriolis(nu) - body.damping(nu) - body.restoring(j[2, :3])
        steepest = 1e3 * jnp.maximum(jnp.abs(eta[4]) - 1.4, 0.0)
        return j @ nu, body.accelerate(forces), steepest

    def in_quaternions(t, x):
        return plant.dynamics(t, x, jnp.zeros(8), Load(jnp.zeros(6), -moments(t)))

    pose = jnp.array([0, 0, 0, 0.3, -0.4, 2.0])
    eta, nu, beyond = tumble(in_euler_angles, (pose, jnp.zeros(6), jnp.zeros(())), 10_000)
    x = tumble(in_quaternions, plant.initial_state(pose), 10_000)
    assert beyond == 0.0
    assert jnp.linalg.norm(eta - pose) > 1.0
    angles = euler_from_rotation(rotation_from_quaternion(x.attitude))

    def short(a, b):
        return (a - b + np.pi) % (2 * np.pi) - np.pi

    np.testing.assert_allclose(x.position, eta[:3], rtol=0, atol=1e-8)
    np.testing.assert_allclose(short(angles, eta[3:]), 0.0, atol=1e-8)
    np.testing.assert_allclose(x.nu, nu, rtol=0, atol=1e-8)


@pytest.mark.full
def test_quaternion_plant_passes_the_vertical():
    """Pitched over and over by a steady moment: pitch goes through 90 deg with everything finite."""
    plant = hybrid_vehicle(odin(), paper_table3("shaft"))
    steady = Load(jnp.zeros(6), -jnp.array([0, 0, 0, 0, 400.0, 0]))

    def looping(t, state):
        x, _ = state
        return plant.dynamics(t, x, jnp.zeros(8), steady), x.nu[4]

    x, turned = tumble(looping, (plant.initial_state(), jnp.zeros(())), 5_000)
    assert turned > 4 * np.pi
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((x, plant.output(jnp.zeros(()), x))))
    np.testing.assert_allclose(jnp.linalg.norm(x.attitude), 1.0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(x.nu[jnp.array([1, 3, 5])], 0.0, atol=1e-12)  # a plane motion stays in its plane
