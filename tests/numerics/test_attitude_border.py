"""I32: q and -q mean the same attitude, errors go the short way round, and nothing unwinds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import rcaf
from undertow.core.contracts import Load, Target
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import attitude_error, rotation_from_quaternion
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import odin

RNG = np.random.default_rng(11)
STARTS = 1000
QUATERNIONS = RNG.normal(size=(STARTS, 4))
QUATERNIONS /= np.linalg.norm(QUATERNIONS, axis=1, keepdims=True)
UPRIGHT = jnp.array([1.0, 0.0, 0.0, 0.0])


errors = jax.jit(jax.vmap(attitude_error))
error = jax.jit(attitude_error)


def about(axis, angle):
    """Unit quaternion of a turn by `angle` about a unit vector."""
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * np.asarray(axis)])


@pytest.mark.parametrize(("sign_target", "sign_actual"), [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_sign_of_either_quaternion_does_not_change_the_error(sign_target, sign_actual):
    targets, actuals = QUATERNIONS[::-1], QUATERNIONS
    plain, flipped = errors(targets, actuals), errors(sign_target * targets, sign_actual * actuals)
    np.testing.assert_allclose(flipped, plain, rtol=0, atol=1e-12)


@pytest.mark.parametrize("degrees", [1, 90, 179, 181, 200, 270, 359])
def test_quaternion_error_is_the_short_turn_in_body_axes(degrees):
    """2 sin(angle/2) about the axis, for the angle in (-180, 180] deg; the world attitude makes no difference."""
    axis, base = np.array([2.0, -1.0, 2.0]) / 3, QUATERNIONS[0]
    turn = about(axis, np.radians(degrees))
    w0, v0, w1, v1 = base[0], base[1:], turn[0], turn[1:]
    target = np.concatenate([[w0 * w1 - v0 @ v1], w0 * v1 + w1 * v0 + np.cross(v0, v1)])  # base, then the turn
    short = np.radians(degrees if degrees <= 180 else degrees - 360)
    np.testing.assert_allclose(error(target, base), 2 * np.sin(short / 2) * axis, rtol=0, atol=1e-14)


@pytest.fixture(scope="module")
def commanded():
    """Voltages of the paper's law, and the acceleration that its model expects of them, for 1000 cases at once."""
    plant = hybrid_vehicle(odin(), paper_table3("ideal"))
    controller = rcaf(plant.model(), preset="paper")

    @jax.jit
    @jax.vmap
    def evaluate(q, nu, goal):
        r = Target(goal, jnp.zeros(6), jnp.zeros(6))
        y = plant.output(jnp.zeros(()), plant.initial_state()._replace(attitude=q, nu=nu))
        volts = controller.command(controller.init(y, r), y, r)[0]
        return volts, controller.model.dynamics.drift(y) + controller.model.dynamics.gain(y) @ volts

    return evaluate


@pytest.mark.full
def test_both_quaternions_of_an_attitude_get_the_same_voltages(commanded):
    """Through the plant's output and the law's command, at all attitudes."""
    nu = 0.3 * RNG.normal(size=(STARTS, 6))
    goals = np.tile([2.0, 3.0, 4.0, 1.0, 0.7, 1.2], (STARTS, 1))
    plus, minus = commanded(QUATERNIONS, nu, goals), commanded(-QUATERNIONS, nu, goals)
    np.testing.assert_allclose(minus[0], plus[0], rtol=1e-12)


def test_euler_error_differs_by_whole_turns_and_is_at_most_half_a_turn():
    model = hybrid_vehicle(odin(), paper_table3("ideal")).model()
    targets, actuals = RNG.uniform(-20, 20, (2, 200, 6))
    error = np.asarray(jax.jit(jax.vmap(model.coordinates.difference))(targets, actuals))
    raw = targets - actuals
    np.testing.assert_array_equal(error[:, :3], raw[:, :3])
    assert np.abs(error[:, 3:]).max() <= np.pi + 1e-14
    turns = (raw - error)[:, 3:] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-13)


@pytest.mark.full
def test_law_turns_the_short_way_across_the_border_of_the_euler_angles(commanded):
    """From any yaw: 20 deg to port across the border, the same wish a turn lower gets the same voltages."""
    yaws = np.linspace(-np.pi, np.pi, STARTS)
    half, level = yaws / 2, np.zeros(STARTS)
    attitudes = np.stack([np.cos(half), level, level, np.sin(half)], axis=1)
    port = np.stack([level] * 5 + [yaws - np.radians(20)], axis=1)
    wrapped = np.where(port < -np.pi, port + 2 * np.pi, port)
    assert (wrapped[:50, 5] > 3 - np.radians(20)).all()
    at_rest = np.zeros((STARTS, 6))
    as_said, expected = commanded(attitudes, at_rest, port)
    np.testing.assert_allclose(commanded(attitudes, at_rest, wrapped)[0], as_said, rtol=0, atol=1e-12)
    short = -np.radians(20)
    np.testing.assert_allclose(expected[:, 5], short + 10 * np.tanh(5 * short / 0.5), rtol=1e-9)


def turned(starts, short_way):
    """Angle turned through by bodies under a quaternion PD, and how far they are from upright after 12 s.

    Without the short way the error keeps the sign that the quaternion happens to have: the classic mistake.
    """
    plant = hybrid_vehicle(odin(), paper_table3("shaft"))
    zero = jnp.zeros(6)

    def motion(short, t, state):
        x, _ = state
        sign = jnp.where(short, 1.0, jnp.where(x.attitude[0] < 0, -1.0, 1.0))
        torque = 60 * sign * attitude_error(UPRIGHT, x.attitude) - 20 * x.nu[3:]
        hover = plant.body.restoring(rotation_from_quaternion(x.attitude)[2])
        wrench = hover + jnp.concatenate([jnp.zeros(3), torque])
        return plant.dynamics(t, x, jnp.zeros(8), Load(zero, -wrench)), jnp.linalg.norm(x.nu[3:])

    def run(q, short):
        def field(t, state):
            return motion(short, t, state)

        def step(state, k):
            return (rk4(field, k * 0.05, state, 0.05), None)

        start = (plant.initial_state()._replace(attitude=q), jnp.zeros(()))
        (x, path), _ = jax.lax.scan(step, start, jnp.arange(240.0))
        return path, jnp.linalg.norm(attitude_error(UPRIGHT, x.attitude))

    return jax.tree.map(np.asarray, jax.jit(jax.vmap(run))(starts, short_way))


@pytest.mark.slow
def test_no_start_unwinds_and_without_the_short_way_half_of_them_do():
    long_starts = QUATERNIONS[QUATERNIONS[:, 0] < 0][:200]
    starts = np.concatenate([QUATERNIONS, long_starts])
    path, left_over = turned(starts, np.arange(len(starts)) < STARTS)
    shortest = 2 * np.arccos(np.abs(QUATERNIONS[:, 0]))
    assert left_over[:STARTS].max() < 1e-4
    assert (path[:STARTS] <= 1.02 * shortest).all()
    assert (path[STARTS:] > np.pi).all()  # negative control: the long way round
