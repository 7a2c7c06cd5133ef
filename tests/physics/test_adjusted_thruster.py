"""A thruster as installed on a vehicle: gains and lag around another one, in the plant and in what laws know of it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import adjusted, commanded_thrust, first_order, t200
from undertow.physics.vehicles import odin
from undertow.scenario.results.run_scenario import run_scenario

VOLTS = jnp.array([-9.0, -2.0, 3.0, 11.0])
GAINS = {"gain": 0.8, "reverse_gain": 0.5, "lag": 2.0}
LAGGED = adjusted(first_order(2.0, 0.1, supply=15.0), **GAINS)
SAME = first_order(1.6, 0.2, reverse_share=0.5, supply=15.0)  # the same in closed form


def settled(thruster, volts, duration, start=None):
    """State of thrusters a time after a command."""
    start = thruster.initial_state(len(volts)) if start is None else start
    step = lambda _, state: rk4(lambda t, x: thruster.dynamics(x, volts), 0.0, state, 1e-3)
    return jax.jit(lambda state: jax.lax.fori_loop(0, round(duration / 1e-3), step, state))(start)


@pytest.mark.parametrize("fidelity", ["static", "shaft", "electromechanical"])
def test_ones_change_no_bit(fidelity):
    inner = t200(fidelity)
    thruster = adjusted(inner)
    state = jax.tree.map(lambda leaf: leaf + 0.5, inner.initial_state(4))
    for name in ("dynamics", "thrust", "current", "powers", "electrical_power"):
        found, expected = (getattr(kind, name)(state, VOLTS) for kind in (thruster, inner))
        jax.tree.map(np.testing.assert_array_equal, found, expected)
    for name in ("stored", "report"):
        jax.tree.map(np.testing.assert_array_equal, getattr(thruster, name)(state), getattr(inner, name)(state))
    assert thruster.input_unit == "V" and float(thruster.voltage_gain()) == float(inner.voltage_gain())
    assert thruster.has_prescribed_acceleration == inner.has_prescribed_acceleration


def test_gains_and_lag_in_closed_form():
    """A first-order lag with gain, share in reverse and time constant multiplied."""
    for duration in (0.05, 0.2, 0.7):
        found = LAGGED.thrust(settled(LAGGED, VOLTS, duration), VOLTS)
        steady = 2.0 * VOLTS * 0.8 * jnp.where(VOLTS < 0, 0.5, 1.0)
        np.testing.assert_allclose(found, steady * (1 - np.exp(-duration / 0.2)), rtol=1e-9)


def test_laws_know_gains_and_lag():
    """Every method of the actuator model as that of the same thruster in closed form."""
    found, expected = (kind.actuator_model(4, False) for kind in (LAGGED, SAME))
    forces, rate, volts = jnp.array([-4.0, -1.0, 2.0, 6.0]), jnp.asarray(12.0), VOLTS
    states, step = (found.init(), expected.init()), jnp.asarray(0.05)
    for _ in range(3):
        states = found.advance(states[0], volts, step), expected.advance(states[1], volts, step)
        for name, arguments in (("force", (volts,)), ("command", (forces, rate)), ("target_of", (volts, rate))):
            np.testing.assert_allclose(
                getattr(found, name)(states[0], *arguments),
                getattr(expected, name)(states[1], *arguments),
                rtol=1e-12,
                err_msg=name,
            )
    for sampled in jnp.array([1.0, 30.0]):
        assert found.max_bandwidth(sampled) == pytest.approx(float(expected.max_bandwidth(sampled)))
    assert float(found.time_constant()) == 0.2
    np.testing.assert_allclose(found.range(found.init(), rate), expected.range(expected.init(), rate), rtol=1e-12)
    still = found.quasi_static()
    np.testing.assert_allclose(still.force(still.init(), still.command(still.init(), forces, rate)), forces)
    np.testing.assert_allclose(LAGGED.voltage_gain(), SAME.voltage_gain())


def test_power_is_balanced_with_a_lag():
    """source + conversion = the others + d(stored)/dt, of a motor that is three times slower."""
    thruster = adjusted(t200("electromechanical"), gain=0.7, lag=3.0)
    state = jax.tree.map(lambda leaf: leaf + 0.1 * VOLTS, thruster.initial_state(4))
    _, stored = jax.jvp(thruster.stored, (state,), (thruster.dynamics(state, VOLTS),))
    powers = thruster.powers(state, VOLTS)
    taken = powers.copper + powers.friction + powers.water + stored
    np.testing.assert_allclose(powers.source + powers.conversion, taken, rtol=1e-12)
    report = thruster.report(state)
    np.testing.assert_allclose(report.acceleration, thruster.dynamics(state, VOLTS).speed, rtol=1e-14)


def test_phi_of_the_paper_holds_forward():
    """T = alpha V + phi, Eq. (15), while the current stands still: L = 0 as the paper assumes."""
    thruster = adjusted(t200("electromechanical", dead_zone=0.0), gain=0.7, lag=3.0)
    motor = thruster.thruster.motor
    volts, speed = jnp.array([6.0, 9.0]), jnp.array([80.0, 120.0])
    current = (volts - motor.back_emf_constant * speed) / motor.resistance
    state = thruster.initial_state(2)._replace(speed=speed, current=current)
    found = thruster.voltage_gain() * volts + thruster.speed_term(thruster.report(state))
    np.testing.assert_allclose(found, thruster.thrust(state, volts), rtol=1e-12)


def test_one_gain_per_thruster():
    gains = np.linspace(0.5, 1.2, 8)
    thruster = adjusted(commanded_thrust(), gain=gains)
    plant = hybrid_vehicle(odin(), thruster)
    assert thruster.count() == 8
    state = plant.thruster.initial_state(8)._replace(thrust=jnp.full(8, -3.0))
    np.testing.assert_allclose(plant.thruster.thrust(state, jnp.zeros(8)), -3.0 * gains)
    with pytest.raises(BadInput, match="`thruster` must have parameters for 8 thrusters, but is for 3"):
        hybrid_vehicle(odin(), adjusted(commanded_thrust(), gain=np.ones(3)))
    with pytest.raises(BadInput, match="`thruster` must have parameters for 8 thrusters, but is for 3"):
        plant.model(thruster=adjusted(commanded_thrust(), gain=np.ones(3)))
    with pytest.raises(BadInput, match="`gain` must be for as many thrusters as `reverse_gain` and `thruster`"):
        adjusted(commanded_thrust(), gain=np.ones(8), reverse_gain=np.ones(3))


def test_what_cannot_be():
    for name in ("gain", "reverse_gain", "lag"):
        with pytest.raises(BadInput, match=f"`{name}` must be positive"):
            adjusted(t200(), **{name: 0.0})
    with pytest.raises(BadInput, match="`gain` must be one number, or one per thruster, but is of shape"):
        adjusted(t200(), gain=np.ones((2, 2)))


def scenario(thruster, controller="robust", **loop):
    return {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": thruster},
        "controller": controller,
        "reference": {"kind": "setpoint", "position": [1, 0.5, -0.5, 0, 0, 0.3]},
        "loop": {"duration": 4.0, "dt": 0.02, "record": 0.1, **loop},
    }


@pytest.mark.full
@pytest.mark.parametrize("controller", ["robust", "pid", "paper"])
def test_a_run_with_ones_is_that_of_the_other_thruster(controller):
    inner = {"kind": "t200", "supply": 16.0}
    runs = [run_scenario(scenario(kind, controller)) for kind in (inner, {"kind": "adjusted", "thruster": inner})]
    positions = [np.asarray(run.outcome.signals["position"]) for run in runs]
    assert positions[0].tobytes() == positions[1].tobytes()
    assert runs[1].facts.supply == 16.0


@pytest.mark.full
def test_a_run_is_that_of_the_same_thruster_in_closed_form():
    """With one gain: with two, the inner thrust lags as if it had one, and the gain changes as it crosses zero."""
    inner = {"kind": "first_order", "thrust_per_volt": 2.0, "supply": 15.0}
    outer = {"kind": "adjusted", "thruster": inner, "gain": 0.8, "lag": 2.0}
    same = inner | {"thrust_per_volt": 1.6, "time_constant": 0.2}
    found, expected = (run_scenario(scenario(kind)).outcome.signals["position"] for kind in (outer, same))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
