"""Each fidelity level of the thruster tends to the next lower one, at the rate that its small parameter sets."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.physics.thrusters import linear_voltage, paper_table3, quadratic_voltage
from undertow.physics.thrusters.fidelity_levels import FIDELITIES, with_fidelity

MOTOR = paper_table3("shaft").motor
VOLTS = jnp.array([-24.0, -6.0, 0.5, 3.0, 12.0])


def fidelity(name, motor=MOTOR, **limits):
    return with_fidelity(motor, name, **limits)


def with_constants(**changes):
    names = tuple(changes)
    return eqx.tree_at(lambda m: [getattr(m, n) for n in names], MOTOR, [jnp.asarray(changes[n]) for n in names])


def voltage(t, depth=0.5):
    """A step at t = 0 with a swing on top."""
    return VOLTS * (1 + depth * jnp.sin(5 * t))


def run(thruster, *, duration, dt, depth=0.5):
    """Thrust and current at the end, from rest."""
    found = _run(thruster, np.asarray(dt), np.asarray(round(duration / dt)), np.asarray(depth))
    return [np.asarray(leaf) for leaf in found]


@eqx.filter_jit
def _run(thruster, dt, steps, depth):
    field = lambda t, state: thruster.dynamics(state, voltage(t, depth))
    move = lambda k, state: rk4(field, jnp.asarray(k, dtype=float) * dt, state, dt)
    state = jax.lax.fori_loop(0, steps, move, thruster.initial_state(5))
    final = voltage(steps.astype(float) * dt, depth)
    return thruster.thrust(state, final), thruster.current(state, final)


@eqx.filter_jit
def steady(thruster, volts):
    """Thrust and current of a thruster without a state."""
    return thruster.thrust((), volts), thruster.current((), volts)


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
    expected = steady(static, voltage(jnp.asarray(1.0)))
    inertias = (4e-4, 2e-4, 1e-4)
    gaps = [
        distance(run(fidelity("shaft", with_constants(rotor_inertia=j)), duration=1.0, dt=2e-4), expected)
        for j in inertias
    ]
    assert gaps[-1] < 2e-3
    np.testing.assert_allclose(np.array(gaps[:-1]) / gaps[1:], 2.0, atol=0.15)


def test_without_friction_and_back_emf_the_static_motor_is_ideal():
    """static -> ideal as k_2 -> 0: the speed term k_2 Om is all that lies between them."""
    expected = np.asarray(steady(fidelity("ideal"), VOLTS)[0])
    gaps = []
    for share in (1e-4, 1e-6, 1e-8):
        motor = with_constants(friction=0.06 * share, back_emf_constant=0.01086 * share)
        thrust, current = map(np.asarray, steady(fidelity("static", motor), VOLTS))
        gaps.append(np.abs(thrust / expected - 1).max())
        _, through = steady(fidelity("ideal", motor), VOLTS)
        np.testing.assert_allclose(current, through, rtol=20 * share**0.5)
    assert gaps[-1] < 1e-7
    np.testing.assert_allclose(np.array(gaps[:-1]) / gaps[1:], 100.0, rtol=0.05)


@pytest.mark.full
@pytest.mark.parametrize("name", ["shaft", "electromechanical"])
def test_dynamic_rungs_settle_on_the_static_one(name):
    expected = steady(fidelity("static"), VOLTS)
    settled = run(fidelity(name), duration=5.0, dt=1e-3, depth=0.0)
    np.testing.assert_allclose(settled[0], expected[0], rtol=1e-9)
    np.testing.assert_allclose(settled[1], expected[1], rtol=1e-9)


@pytest.mark.full
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


@pytest.mark.full
@pytest.mark.parametrize("name", FIDELITIES)
def test_nothing_turns_inside_the_dead_zone(name):
    """A voltage inside acts as none, a voltage outside as itself."""
    loose, limited = fidelity(name), fidelity(name, dead_zone=4.0)
    state = jax.tree.map(lambda leaf: np.linspace(-20.0, 20.0, leaf.size), loose.initial_state(5))
    outside = np.where(np.abs(VOLTS) > 4, VOLTS, 0.0)
    of = eqx.filter_jit(lambda x, state, v: (x.thrust(state, v), x.dynamics(state, v), x.current(state, v)))
    found, expected = of(limited, state, VOLTS), of(loose, state, outside)
    for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        np.testing.assert_array_equal(a, b)


def test_memoryless_models_go_through_the_static_motor_at_ten_volts():
    """T = c_0 V and T = c_V V|V| of Fig. 2, with their currents, to the three digits of their defaults."""
    ten = np.array([-10.0, 10.0])
    static = steady(fidelity("static"), ten)
    for model, factor in ((linear_voltage(), 2), (quadratic_voltage(), 4)):
        found = steady(model, ten)
        np.testing.assert_allclose(found, static, rtol=5e-3)
        np.testing.assert_allclose(steady(model, 2 * ten)[0], factor * np.asarray(found[0]))


@pytest.mark.parametrize(
    "limits", [dict(supply=0.0), dict(supply=-24.0), dict(supply=float("nan")), dict(dead_zone=-1.0)]
)
def test_impossible_limits_are_refused(limits):
    with pytest.raises(BadInput, match=f"`{next(iter(limits))}` must be"):
        fidelity("shaft", **limits)


def test_a_winding_needs_an_inductance():
    with pytest.raises(BadInput, match="`inductance` must be positive"):
        fidelity("electromechanical", with_constants(inductance=0.0))
    for level in ("ideal", "static", "shaft"):
        fidelity(level, with_constants(inductance=0.0))
