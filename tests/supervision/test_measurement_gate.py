"""The gate of a vehicle's measurements by itself: what is replaced, by which prediction, and how large each finding is."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded

from undertow.control.supervision.innovations import InnovationMonitor
from undertow.control.supervision.measurement_gate import MeasurementGate
from undertow.control.supervision.stuck_readings import StuckReadings
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.thrusters.thruster import PropellerReport

DT = 0.02
RATES = np.array([0.4, -0.2, 0.1, 0.0, 0.0, 0.3])
LIMITS = {"max_distance": 1e4, "max_speed": 10.0, "max_rate": 8.0}
JUMPS = {"jump_position": 1.0, "jump_angle": 0.5, "jump_velocity": 2.0, "jump_rate": 1.5}


@functools.cache
def gate():
    stuck = StuckReadings(0.02, 0.03, 10.0, (False, False, False, True, True, True))
    return MeasurementGate(stuck, InnovationMonitor(), **LIMITS, **JUMPS)


measured = jax.jit(measurement_of_outputs)


def at(t, add=0.0, add_rates=0.0):
    """A level vehicle that moves steadily and turns."""
    return measured(RATES * t + add, RATES + add_rates, PropellerReport(20.0 + np.arange(8.0), None))


@jax.jit
def passed_and_after(state, y, believe):
    """What the gate finds, and its state one step later; the velocity does not change but for the turning axes."""
    passed = gate().pass_through(state, y, believe)
    nu = passed.measurement.body.nu
    rate = jnp.concatenate([-jnp.cross(nu[3:], nu[:3]), jnp.zeros(3)])
    return passed, gate().after(passed, rate, jnp.asarray(DT))


@functools.cache
def steady():
    """State after ten steps in which nothing is wrong, and the time."""
    state = jax.tree.map(np.asarray, jax.jit(lambda y: gate().init(y))(at(0.0)))
    for k in range(10):
        passed, state = passed_and_after(state, at(k * DT), np.asarray(False))
        assert float(passed.not_finite) == float(passed.unreported) == 0.0
        assert float(passed.jump) < 0.01 and float(passed.missing) < 0.1
    return state, 10 * DT


def found(add=0.0, add_rates=0.0, believe=False):
    state, t = steady()
    return passed_and_after(state, at(t, add, add_rates), np.asarray(believe))[0]


def only(axis, value):
    return np.where(np.arange(6) == axis, value, 0.0)


def test_what_is_right_passes_with_its_bits():
    _, t = steady()
    passed = found()
    for one, other in zip(jax.tree.leaves(passed.measurement), jax.tree.leaves(at(t)), strict=True):
        np.testing.assert_array_equal(one, other)
    assert float(passed.not_finite) == float(passed.unreported) == 0.0
    assert float(passed.jump) < 1e-3 and float(passed.missing) < 1e-9


def test_a_jump_is_replaced_by_the_prediction_unless_it_is_believed():
    _, t = steady()
    for add, rates, size in (
        (only(0, 5.0), 0.0, 5.0 / JUMPS["jump_position"]),
        (only(5, 0.6), 0.0, 2 * np.sin(0.3) / JUMPS["jump_angle"]),
        (0.0, only(2, 3.0), 3.0 / JUMPS["jump_velocity"]),
        (0.0, only(3, 2.0), 2.0 / JUMPS["jump_rate"]),
    ):
        passed = found(add, rates)
        assert float(passed.jump) == pytest.approx(size, rel=1e-2)
        np.testing.assert_allclose(passed.measurement.position, RATES * t, atol=1e-3)
        np.testing.assert_allclose(np.asarray(passed.measurement.velocity)[2:], RATES[2:], atol=1e-2)
        believed = found(add, rates, believe=True)
        np.testing.assert_allclose(believed.measurement.position, RATES * t + add, atol=1e-12)


def test_readings_that_are_implausible_or_no_numbers_are_counted_and_replaced():
    _, t = steady()
    passed = found(only(1, np.nan))
    assert float(passed.not_finite) == 1.0 and float(passed.jump) < 1e-3
    np.testing.assert_allclose(passed.measurement.position, RATES * t, atol=1e-3)
    passed = found(0.0, only(2, 40.0), believe=True)
    assert float(passed.implausible) == pytest.approx(40.1 / LIMITS["max_speed"])
    np.testing.assert_allclose(passed.measurement.velocity, RATES, atol=1e-2)
    assert float(found(only(0, 3e4), believe=True).implausible) == pytest.approx(3.0, rel=1e-3)
    assert float(found(0.0, only(3, 16.0), believe=True).implausible) == pytest.approx(16 / LIMITS["max_rate"])


def test_a_lost_report_is_held():
    state, t = steady()
    report = PropellerReport(np.array([np.nan, 2e5, *np.arange(6.0)]), None)
    passed, _ = passed_and_after(state, at(t)._replace(actuator=report), np.asarray(False))
    assert float(passed.unreported) == 2.0
    np.testing.assert_array_equal(passed.measurement.actuator.speed, [20.0, 21.0, *np.arange(6.0)])


def test_the_same_bits_are_stuck_once_motion_is_missing():
    """What is missing grows by the distance of a step, as velocities have had the same bits for long; then it is predicted."""
    state, t = steady()
    held, series = at(t), []
    for _ in range(40):
        passed, state = passed_and_after(state, held, np.asarray(False))
        series.append((float(passed.missing), *np.asarray(passed.measurement.position)))
    step = DT * np.linalg.norm(RATES[:3])
    np.testing.assert_allclose(np.array(series)[:, 0], step * np.arange(40) / 0.02, rtol=1e-3, atol=1e-9)
    assert series[2][1] == RATES[0] * t and series[-1][1] > RATES[0] * t + 0.1
    is_as_recorded("gate: stuck", (series, state))
