"""Each fidelity level of the thruster tends to the next lower one, at the rate that its small parameter sets."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.numerics.integrators import rk4
from undertow.thrusters import linear_voltage, paper_table3, quadratic_voltage
from undertow.thrusters.fidelity import FIDELITIES, with_fidelity

MOTOR = paper_table3("shaft").motor
VOLTS = jnp.array([-24.0, -6.0, 0.5, 3.0, 12.0])


def fidelity(name, motor=MOTOR, **limits):
    return with_fidelity(motor, name, **limits)


def with_constants(**changes):
    names = tuple(changes)
    return eqx.tree_at(lambda m: [getattr(m, n) for n in names], MOTOR, [jnp.asarray(changes[n]) for n in names])


def voltage(t):
    """A step at t = 0 with a swing on top."""
    return VOLTS * (1 + 0.5 * jnp.sin(5 * t))


def run(thruster, *, duration, dt, volts=voltage):
    """Thrust and current at the end, from rest."""

    @jax.jit
    def simulate():
        def field(t, state):
            return thruster.dynamics(state, volts(t))

        def step(state, k):
            return (rk4(field, k * dt, state, jnp.asarray(dt)), None)

        steps = jnp.arange(float(round(duration / dt)))
        state, _ = jax.lax.scan(step, thruster.initial_state(5), steps)
        final = volts(jnp.asarray(duration))
        return thruster.thrust(state, final), thruster.current(state, final)

    return [np.asarray(leaf) for leaf in simulate()]


def distance(found, expected):
    return max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip(found, expected, strict=True))


@pytest.mark.full
def test_without_inductance_the_winding_follows_the_shaft():
    """electromechanical -> shaft at first order in L, in thrust and current, in the middle of a transient."""
    times = dict(duration=0.1, dt=5e-5)
    shaft = run(fidelity("shaft"), **times)
    gaps = [
        distance(run(fidelity("electromechanical", with_constants(inductance=h)), **times), shaft)
        for h in (4e-4, 2e-4, 1e-4)
    ]
    assert gaps[-1] < 5e-3
    np.testing.assert_allclose(np.array(gaps[:-1]) / gaps[1:], 2.0, atol=0.15)


@pytest.mark.full
def test_without_rotor_inertia_the_shaft_follows_the_voltage():
    """shaft -> static at first order in J, while the voltage moves."""
    static = fidelity("static")
    final = voltage(jnp.asarray(1.0))
    expected = static.thrust(static.initial_state(5), final), static.current(static.initial_state(5), final)
    inertias = (4e-4, 2e-4, 1e-4)
    gaps = [
        distance(run(fidelity("shaft", with_constants(rotor_inertia=j)), duration=1.0, dt=2e-4), expected)
        for j in inertias
    ]
    assert gaps[-1] < 2e-3
    np.testing.assert_allclose(np.array(gaps[:-1]) / gaps[1:], 2.0, atol=0.15)


def test_without_friction_and_back_emf_the_static_motor_is_ideal():
    """static -> ideal as k_2 -> 0: the speed term k_2 Om is all that lies between them."""
    ideal = fidelity("ideal")
    expected = np.asarray(ideal.thrust(ideal.initial_state(5), VOLTS))
    gaps = []
    for share in (1e-4, 1e-6, 1e-8):
        motor = with_constants(friction=0.06 * share, back_emf_constant=0.01086 * share)
        static = fidelity("static", motor)
        thrust = np.asarray(static.thrust(static.initial_state(5), VOLTS))
        gaps.append(np.abs(thrust / expected - 1).max())
        current, through = static.current((), VOLTS), fidelity("ideal", motor).current((), VOLTS)
        np.testing.assert_allclose(current, through, rtol=20 * share**0.5)
    assert gaps[-1] < 1e-7
    np.testing.assert_allclose(np.array(gaps[:-1]) / gaps[1:], 100.0, rtol=0.05)


@pytest.mark.parametrize("name", ["shaft", "electromechanical"])
def test_dynamic_rungs_settle_on_the_static_one(name):
    static = fidelity("static")
    expected = np.asarray(static.thrust((), VOLTS)), np.asarray(static.current((), VOLTS))
    settled = run(fidelity(name), duration=5.0, dt=1e-3, volts=lambda t: jnp.asarray(VOLTS))
    np.testing.assert_allclose(settled[0], expected[0], rtol=1e-9)
    np.testing.assert_allclose(settled[1], expected[1], rtol=1e-9)


def test_speed_term_and_thrust_add_up_to_the_voltage():
    """Eq. (15): T = alpha V + phi + Delta_V, with Delta_V = -alpha L I_dot."""
    thruster, rng = fidelity("electromechanical"), np.random.default_rng(9)
    state = thruster.initial_state(5)._replace(
        speed=jnp.asarray(30 * rng.normal(size=5)), current=jnp.asarray(8 * rng.normal(size=5))
    )
    rates = thruster.dynamics(state, VOLTS)
    report = thruster.report(state)
    np.testing.assert_allclose(report.speed, state.speed, rtol=0)
    np.testing.assert_allclose(report.acceleration, rates.speed, rtol=1e-14)
    alpha, phi = thruster.voltage_gain(), thruster.speed_term(report)
    total = alpha * VOLTS + phi - alpha * MOTOR.inductance * rates.current
    np.testing.assert_allclose(thruster.thrust(state, VOLTS), total, rtol=0, atol=1e-10 * np.abs(alpha * VOLTS).max())


@pytest.mark.parametrize("name", FIDELITIES)
def test_nothing_turns_inside_the_dead_zone(name):
    """A voltage inside acts as none, a voltage outside as itself."""
    loose, limited = fidelity(name), fidelity(name, dead_zone=4.0)
    state = jax.tree.map(lambda leaf: leaf + jnp.linspace(-20.0, 20.0, leaf.size), loose.initial_state(5))
    outside = jnp.where(jnp.abs(VOLTS) > 4, VOLTS, 0.0)
    for of in ("thrust", "dynamics", "current"):
        for a, b in zip(
            *(jax.tree.leaves(getattr(x, of)(state, v)) for x, v in ((limited, VOLTS), (loose, outside))), strict=True
        ):
            np.testing.assert_array_equal(a, b)


def test_memoryless_models_go_through_the_static_motor_at_ten_volts():
    """T = c_0 V and T = c_V V|V| of Fig. 2, with their currents, to the three digits of their defaults."""
    static, ten = fidelity("static"), jnp.array([-10.0, 10.0])
    for model in (linear_voltage(), quadratic_voltage()):
        np.testing.assert_allclose(model.thrust((), ten), static.thrust((), ten), rtol=5e-3)
        np.testing.assert_allclose(model.current((), ten), static.current((), ten), rtol=5e-3)
    np.testing.assert_allclose(linear_voltage().thrust((), 2 * ten), 2 * linear_voltage().thrust((), ten))
    np.testing.assert_allclose(quadratic_voltage().thrust((), 2 * ten), 4 * quadratic_voltage().thrust((), ten))


@pytest.mark.parametrize(
    "limits", [dict(supply=0.0), dict(supply=-24.0), dict(supply=float("nan")), dict(dead_zone=-1.0)]
)
def test_impossible_limits_are_refused(limits):
    with pytest.raises(BadInput, match=f"`{next(iter(limits))}` must be"):
        fidelity("shaft", **limits)
