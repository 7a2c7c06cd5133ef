"""Thrust that is not affine in the voltage: inflow and its inverse, and the model that is solved for the voltage."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.controllers.rcaf import rcaf
from undertow.core.contracts import Target, forced_acceleration, input_for, known_acceleration
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.numerics.integrators import rk4
from undertow.numerics.rotations import cross
from undertow.plants.hybrid_vehicle import hybrid_vehicle
from undertow.thrusters.axial_flow import axial_flow
from undertow.thrusters.first_order import first_order
from undertow.thrusters.inflow import advance_speed, static_thrust_for, with_inflow
from undertow.thrusters.linear_voltage import linear_voltage
from undertow.thrusters.quadratic_voltage import quadratic_voltage
from undertow.thrusters.t200 import t200
from undertow.vehicles.bluerov2_heavy import bluerov2_heavy

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
    static = static_thrust_for(jnp.asarray(thrust), jnp.asarray(LOSS), jnp.asarray(speed))
    np.testing.assert_allclose(with_inflow(static, jnp.asarray(LOSS), jnp.asarray(speed)), thrust, atol=1e-12)
    mirrored = static_thrust_for(-jnp.asarray(thrust), jnp.asarray(LOSS), -jnp.asarray(speed))
    off_the_jump = np.abs(4 * thrust + (LOSS * speed) * np.abs(LOSS * speed)) > 1e-9
    np.testing.assert_allclose(np.asarray(mirrored)[off_the_jump], -np.asarray(static)[off_the_jump], atol=1e-12)
    np.testing.assert_allclose(static_thrust_for(jnp.asarray(thrust), jnp.asarray(LOSS), jnp.zeros(())), thrust)


@pytest.mark.full
@pytest.mark.parametrize("speed", [0.8, -0.8])
def test_inverse_jumps_once_and_not_at_zero_thrust(speed):
    """By 0.29 c^2 at -c|c|/4, c = lambda u; elsewhere no two neighbours of a fine grid differ by more than it allows."""
    c = LOSS * speed
    edge = -c * abs(c) / 4
    thrust = np.linspace(-3, 3, 600_001)
    static = np.asarray(static_thrust_for(jnp.asarray(thrust), jnp.asarray(LOSS), jnp.asarray(speed)))
    steps = np.abs(np.diff(static))
    assert thrust[steps.argmax()] == pytest.approx(edge, abs=2e-5)
    assert steps.max() == pytest.approx((0.25 + (np.sqrt(2) - 1) ** 2 / 4) * c**2, rel=0.02)
    assert np.sort(steps)[-2] < 0.02 and abs(edge) > 0.3


@pytest.mark.full
def test_slopes_are_finite_at_rest():
    for function in (with_inflow, static_thrust_for):
        slopes = jax.grad(lambda t, u, function=function: function(t, jnp.asarray(LOSS), u), (0, 1))(0.0, 0.0)
        assert np.isfinite(slopes).all()


def test_advance_speed_is_that_of_the_point_of_the_propeller():
    """B^T nu = direction . (v + omega x r) of each thruster."""
    vehicle, nu = bluerov2_heavy(), jnp.asarray([0.5, -0.2, 0.3, 0.4, -0.6, 0.7])
    found = advance_speed(vehicle.thruster_matrix(), nu)
    direction, place = vehicle.thruster_directions, vehicle.thruster_positions
    each = [d @ (nu[:3] + cross(nu[3:], p)) for d, p in zip(direction, place, strict=True)]
    np.testing.assert_allclose(found, each, atol=1e-12)


THRUSTERS = {
    "quadratic": quadratic_voltage(),
    "subtracted dead zone": quadratic_voltage(dead_zone=1.0, dead_zone_kind="subtract"),
    "T200 static": t200("static", dead_zone_kind="subtract"),
    "T200 ideal": t200("ideal", dead_zone_kind="subtract"),
    "axial flow": axial_flow(),
    "lagging": first_order(power=1.7, reverse_share=0.8, linear_gain=8.0),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.full) if name == "axial flow" else name for name in THRUSTERS]
)
@pytest.mark.parametrize("loss", [None, LOSS])
def test_solution_gives_the_demanded_acceleration(name, loss):
    """g(x, solve(x, a)) = a for several accelerations in motion; the affine inverse misses them."""
    plant = hybrid_vehicle(bluerov2_heavy(), THRUSTERS[name], ledger=False, inflow_loss=loss)
    dynamics = plant.model(affine=False).dynamics
    for acceleration in jnp.asarray(np.random.default_rng(4).normal(size=(5, 6))):
        u = input_for(dynamics, MOVING, acceleration)
        np.testing.assert_allclose(forced_acceleration(dynamics, MOVING, u), acceleration, atol=1e-9)
        affine = dynamics.invert(MOVING, acceleration)
        assert np.abs(forced_acceleration(dynamics, MOVING, affine) - acceleration).max() > 0.05


@pytest.mark.parametrize("loss", [None, LOSS])
def test_model_is_the_plant_in_steady_state(loss):
    """F + g(x, V) of the model = x_ddot of the plant, fidelity `static`, J_dot nu aside."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200("static"), inflow_loss=loss)
    x = plant.initial_state(MOVING.position, MOVING.velocity)
    y, u = plant.output(0.0, x), jnp.asarray([3.0, -4.0, 5.0, -6.0, 2.5, 7.0, -2.0, 0.5])
    dynamics = plant.model(affine=False).dynamics
    found = dynamics.drift(y) + forced_acceleration(dynamics, y, u)
    np.testing.assert_allclose(found, plant.acceleration(0.0, x, u, plant.no_load()), atol=1e-10)


@pytest.mark.full
def test_linear_thrust_makes_both_models_one():
    """With T = c V and no inflow the paper's law has the same command and adaptation, by G and by the solution."""
    plant = hybrid_vehicle(bluerov2_heavy(), linear_voltage(), ledger=False)
    r = Target(MOVING.position + 0.3, MOVING.velocity, jnp.ones(6))
    found = []
    for affine in (True, False):
        law = rcaf(plant.model(affine=affine))
        z = law.advance(law.init(MOVING, r), MOVING, r, jnp.arange(8.0), jnp.asarray(1e-3))
        u, signals = law.command(z, MOVING, r)
        found.append((u, z, signals, known_acceleration(law, z, MOVING, u)))
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
    thrust = jnp.asarray([-20.0, -6.0, -0.5, 0.2, 4.0, 11.0, 24.0])
    volts = thruster.steady_voltage(thrust)
    step = lambda state, _: (rk4(lambda t, x: thruster.dynamics(x, volts), jnp.zeros(()), state, 2e-3), None)
    state, _ = jax.jit(lambda x: jax.lax.scan(step, x, None, length=30_000))(thruster.initial_state(7))
    np.testing.assert_allclose(thruster.thrust(state, volts), thrust, rtol=1e-6)
    np.testing.assert_allclose(thruster.steady_thrust(volts), thrust, rtol=1e-9)
    inside = jnp.asarray([-0.8, 0.0, 0.85])
    np.testing.assert_array_equal(thruster.steady_thrust(inside), 0.0)


@pytest.mark.full
def test_slope_of_the_steady_thrust_of_axial_flow():
    """That of differences, on both sides of the dead zone."""
    slope = jax.vmap(jax.grad(axial_flow().steady_thrust))(jnp.asarray([-2.5, -1.0, 1.2, 3.0]))
    at, h = np.asarray([-2.5, -1.0, 1.2, 3.0]), 1e-4
    curve = lambda volts: np.asarray(axial_flow().steady_thrust(jnp.asarray(volts)))
    np.testing.assert_allclose(slope, (curve(at + h) - curve(at - h)) / (2 * h), rtol=1e-5)
