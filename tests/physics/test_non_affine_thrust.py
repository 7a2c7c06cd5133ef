"""Thrust that is not affine in the voltage: inflow and its inverse, and the model that is solved for the voltage."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.core.contracts import Target, forced_acceleration, input_for
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.numerics.integrators import rk4
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.axial_flow import axial_flow
from undertow.physics.thrusters.first_order import first_order
from undertow.physics.thrusters.inflow import advance_speed, static_thrust_for, with_inflow
from undertow.physics.thrusters.linear_voltage import linear_voltage
from undertow.physics.thrusters.quadratic_voltage import quadratic_voltage
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy

LOSS = 1.6
MOVING = measurement_of_outputs(
    jnp.asarray([1.0, -2.0, 3.0, 0.2, -0.3, 0.9]), jnp.asarray([0.4, -0.3, 0.2, 0.1, -0.2, 0.3])
)


def test_inflow_is_that_of_a_linear_thrust_coefficient():
    """T = rho D^4 (K_0 - K_1 J) n^2 with J = u / (n D), at a point and through the definition of lambda."""
    rho, diameter, k0, k1, n, u = 1000.0, 0.076, 0.445, 0.4, 20.0, 0.7
    static = rho * diameter**4 * k0 * n**2
    loss = k1 * diameter * np.sqrt(rho / k0)
    expected = rho * diameter**4 * (k0 - k1 * u / (n * diameter)) * n**2
    assert float(with_inflow(jnp.asarray(static), jnp.asarray(loss), jnp.asarray(u))) == pytest.approx(expected)


def test_static_thrust_is_the_inverse_of_inflow():
    """On a grid of thrusts and speeds, both directions of each, zero included; and odd: mirrored, it is mirrored."""
    grid = np.meshgrid(np.linspace(-30, 30, 121), np.linspace(-1.5, 1.5, 61))
    thrust, speed = (axis.ravel() for axis in grid)
    inverse = jax.jit(static_thrust_for)
    static = np.asarray(inverse(thrust, LOSS, speed))
    np.testing.assert_allclose(jax.jit(with_inflow)(static, LOSS, speed), thrust, atol=1e-12)
    mirrored = np.asarray(inverse(-thrust, LOSS, -speed))
    off_the_jump = np.abs(4 * thrust + (LOSS * speed) * np.abs(LOSS * speed)) > 1e-9
    np.testing.assert_allclose(mirrored[off_the_jump], -static[off_the_jump], atol=1e-12)
    np.testing.assert_allclose(inverse(thrust, LOSS, np.zeros(thrust.size)), thrust)


@pytest.mark.full
@pytest.mark.parametrize("speed", [0.8, -0.8])
def test_inverse_jumps_once_and_not_at_zero_thrust(speed):
    """By 0.29 c^2 at -c|c|/4, c = lambda u; elsewhere no two neighbours of a fine grid differ by more than it allows."""
    c = LOSS * speed
    edge = -c * abs(c) / 4
    thrust = np.linspace(-3, 3, 600_001)
    static = np.asarray(jax.jit(static_thrust_for)(thrust, LOSS, speed))
    steps = np.abs(np.diff(static))
    assert thrust[steps.argmax()] == pytest.approx(edge, abs=2e-5)
    assert steps.max() == pytest.approx((0.25 + (np.sqrt(2) - 1) ** 2 / 4) * c**2, rel=0.02)
    assert np.sort(steps)[-2] < 0.02 and abs(edge) > 0.3


@pytest.mark.full
def test_slopes_are_finite_at_rest():
    for function in (with_inflow, static_thrust_for):
        slopes = jax.jit(jax.grad(lambda t, u, of=function: of(t, jnp.asarray(LOSS), u), (0, 1)))(0.0, 0.0)
        assert np.isfinite(slopes).all()


def test_advance_speed_is_that_of_the_point_of_the_propeller():
    """B^T nu = direction . (v + omega x r) of each thruster."""
    vehicle, nu = bluerov2_heavy(), np.array([0.5, -0.2, 0.3, 0.4, -0.6, 0.7])
    found = advance_speed(vehicle.thruster_matrix(), jnp.asarray(nu))
    direction, place = map(np.asarray, (vehicle.thruster_directions, vehicle.thruster_positions))
    each = (direction * (nu[:3] + np.cross(nu[3:], place))).sum(1)
    np.testing.assert_allclose(found, each, atol=1e-12)


THRUSTERS = {
    "quadratic": quadratic_voltage(),
    "subtracted dead zone": quadratic_voltage(dead_zone=1.0, dead_zone_kind="subtract"),
    "T200 static": t200("static", dead_zone_kind="subtract"),
    "T200 ideal": t200("ideal", dead_zone_kind="subtract"),
    "axial flow": axial_flow(),
    "lagging": first_order(power=1.7, reverse_share=0.8, linear_gain=8.0),
}


QUICK = {("quadratic", None), ("lagging", None), ("T200 static", LOSS)}
CASES = [(name, loss) for name in THRUSTERS for loss in (None, LOSS)]


@pytest.mark.parametrize(
    ("name", "loss"), [case if case in QUICK else pytest.param(*case, marks=pytest.mark.full) for case in CASES]
)
def test_solution_gives_the_demanded_acceleration(name, loss):
    """g(x, solve(x, a)) = a for several accelerations in motion; the affine inverse misses them."""
    plant = hybrid_vehicle(bluerov2_heavy(), THRUSTERS[name], ledger=False, inflow_loss=loss)
    dynamics = plant.model(affine=False).dynamics

    def given(acceleration):
        u, affine = input_for(dynamics, MOVING, acceleration), dynamics.invert(MOVING, acceleration)
        return forced_acceleration(dynamics, MOVING, u), forced_acceleration(dynamics, MOVING, affine)

    accelerations = np.random.default_rng(4).normal(size=(5, 6))
    found, missing = jax.jit(lambda accelerations: jax.lax.map(given, accelerations))(accelerations)
    np.testing.assert_allclose(found, accelerations, atol=1e-9)
    assert (np.abs(missing - accelerations).max(1) > 0.05).all()


@pytest.mark.parametrize("loss", [pytest.param(None, marks=pytest.mark.full), LOSS])
def test_model_is_the_plant_in_steady_state(loss):
    """F + g(x, V) of the model = x_ddot of the plant, fidelity `static`, J_dot nu aside."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200("static"), inflow_loss=loss)
    x = plant.initial_state(MOVING.position, MOVING.velocity)
    dynamics = plant.model(affine=False).dynamics

    @jax.jit
    def both(x, u):
        y = plant.output(0.0, x)
        found = dynamics.drift(y) + forced_acceleration(dynamics, y, u)
        return found, plant.acceleration(0.0, x, u, plant.no_load())

    found, expected = both(x, np.asarray([3.0, -4.0, 5.0, -6.0, 2.5, 7.0, -2.0, 0.5]))
    np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.full
def test_linear_thrust_makes_both_models_one():
    """With T = c V and no inflow the paper's law has the same command and adaptation, by G and by the solution."""
    plant = hybrid_vehicle(bluerov2_heavy(), linear_voltage(), ledger=False)
    r = Target(MOVING.position + 0.3, MOVING.velocity, jnp.ones(6))
    found = []
    for affine in (True, False):
        law = rcaf(plant.model(affine=affine), preset="paper")

        @jax.jit
        def step(u, law=law):
            z = law.advance(law.init(MOVING, r), MOVING, r, u, jnp.asarray(1e-3))
            u, signals = law.command(z, MOVING, r)
            return u, z, signals, law.known_acceleration(z, MOVING, u)

        found.append(step(jnp.arange(8.0)))
    for one, other in zip(*map(jax.tree.leaves, found), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


def test_bad_options():
    plant = hybrid_vehicle(bluerov2_heavy(), t200("electromechanical"))
    with pytest.raises(BadInput, match="speed_sensor"):
        plant.model(affine=False, speed_sensor=True)
    with pytest.raises(BadInput, match="inflow_loss"):
        hybrid_vehicle(bluerov2_heavy(), t200(), inflow_loss=-1.0)


@pytest.mark.full
def test_axial_flow_settles_at_the_thrust_of_its_steady_voltage():
    """Integrated until flow and speed rest, forwards and backwards; the thrust of a voltage is the inverse."""
    thruster = axial_flow()
    thrust = np.asarray([-20.0, -6.0, -0.5, 0.2, 4.0, 11.0, 24.0])

    @jax.jit
    def settled(thrust):
        volts = thruster.steady_voltage(thrust)
        step = lambda _, x: rk4(lambda t, x: thruster.dynamics(x, volts), jnp.zeros(()), x, 2e-3)
        state = jax.lax.fori_loop(0, 30_000, step, thruster.initial_state(7))
        return thruster.thrust(state, volts), thruster.steady_thrust(volts)

    found, steady = settled(thrust)
    np.testing.assert_allclose(found, thrust, rtol=1e-6)
    np.testing.assert_allclose(steady, thrust, rtol=1e-9)
    inside = np.asarray([-0.8, 0.0, 0.85])
    np.testing.assert_array_equal(jax.jit(lambda volts: thruster.steady_thrust(volts))(inside), 0.0)


@pytest.mark.full
def test_slope_of_the_steady_thrust_of_axial_flow():
    """That of differences, on both sides of the dead zone."""
    at, h, thruster = np.asarray([-2.5, -1.0, 1.2, 3.0]), 1e-4, axial_flow()
    curve = jax.jit(lambda volts: thruster.steady_thrust(volts))
    slope = jax.jit(jax.vmap(jax.grad(lambda volts: thruster.steady_thrust(volts))))(at)
    np.testing.assert_allclose(slope, (curve(at + h) - curve(at - h)) / (2 * h), rtol=1e-5)
