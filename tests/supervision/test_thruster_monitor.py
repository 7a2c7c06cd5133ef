"""The residual of the monitor in closed form, and what it makes of it."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded

import undertow as ut
from undertow.control.controllers.pid import pid
from undertow.control.supervision.fault_tolerant_law import fault_tolerant
from undertow.core.contracts import BodyMotion, Measurement
from undertow.core.errors import BadInput
from undertow.physics.thrusters.thruster import PropellerReport

DT = 0.01
WARM = 2000  # steps, so that the covariance is known


def monitor_of(speed_sensor=False, **options):
    thruster = ut.thrusters.t200(fidelity="shaft" if speed_sensor else "static")
    model = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), thruster).model(speed_sensor=False)
    if speed_sensor:
        actuators = thruster.actuator_model(8, True)
        model = model.in_body_axes()._replace(actuators=actuators)
    law = fault_tolerant(pid(model, sampling_time=DT), DT, **options)
    return law.monitor, law.law.model


def at(nu, report=None):
    return Measurement(np.zeros(6), nu, report, BodyMotion(np.array([1.0, 0.0, 0.0, 0.0]), np.eye(3), nu))


@functools.cache
def plain():
    """The monitor of a vehicle without speed sensors, and its model."""
    return monitor_of()


@jax.jit
def followed(state, nu, first, steps, amplitude, factor, load):
    """State after steps of a body whose velocity obeys the nominal model with other forces, in Euler's steps.

    Args:
        state, nu: of the monitor and of the body before.
        first, steps: number of the first step, and how many.
        amplitude: of the change of the input from step to step, and the input without it, V.
        factor: of the force of each thruster.
        load: acceleration, m/s^2 and rad/s^2.
    """
    monitor, model = plain()
    dynamics = model.dynamics

    def step(k, carry):
        state, nu = carry
        y, u = at(nu), amplitude[1] + amplitude[0] * jnp.sin(0.05 * k + jnp.arange(8.0))
        rate = dynamics.drift(y) + dynamics.gain(y) @ (factor * model.actuators.force((), u)) + load
        return monitor.advance(state, model, y, u, 1 - state.lost, jnp.asarray(DT)), nu + DT * rate

    return jax.lax.fori_loop(first, first + steps, step, (state, nu))


NONE = np.zeros(6)  # no load
# Volts of eight thrusters, each above 4 V.
CHANGING = np.stack([np.full(8, 0.5), [5.0, -6.0, 5.5, -7.0, 6.0, -5.0, 7.0, -6.5]])


@functools.cache
def start():
    """State of the monitor and velocity at rest."""
    monitor, model = plain()
    rest = np.zeros(6)
    return jax.tree.map(np.asarray, jax.jit(lambda nu: monitor.init(model, at(nu)))(rest)), rest


@functools.cache
def healthy():
    """The same after a while in which nothing fails."""
    return followed(*start(), 0, WARM, CHANGING, np.ones(8), NONE)


def later(begin, steps, factor, load=NONE, first=WARM):
    return followed(*begin, first, steps, CHANGING, np.asarray(factor, dtype=float), load)


@jax.jit
def each_lost(begin, factors):
    """What is found lost 50 steps later, for several sets of failed thrusters."""
    return jax.vmap(lambda factor: followed(*begin, WARM, 50, CHANGING, factor, NONE)[0].lost)(factors)


@pytest.mark.full
def test_the_residual_is_the_unexplained_acceleration_behind_two_low_passes():
    load, steps = np.array([0.2, -0.1, 0.3, 0.05, -0.4, 0.1]), 12
    state, _ = followed(*start(), 0, steps, np.stack([np.zeros(8), np.full(8, 3.0)]), np.ones(8), load)
    share, one, two = 1 - np.exp(-15.0 * DT), 0.0, 0.0
    for _ in range(steps):
        two, one = two + share * (one - two), one + share * (1.0 - one)
    np.testing.assert_allclose(state.residual, two * load, rtol=1e-9)
    assert not state.lost.any()


# Factors of the forces of thrusters that fail: each off, each reversed, and pairs that are off.
SINGLE = {share: 1 + (share - 1) * np.eye(8) for share in (0.0, -1.0)}
PAIRS = np.array([np.isin(np.arange(8), pair) for pair in itertools.combinations(range(8), 2)]).astype(float)


@functools.cache
def lost_after():
    """What is found lost 50 steps after the failure: each off, each reversed, pairs off."""
    found = np.asarray(each_lost(healthy(), np.concatenate([*SINGLE.values(), 1 - PAIRS])))
    return found[:8], found[8:16], found[16:]


@pytest.mark.full
@pytest.mark.parametrize("which", [0, 1], ids=["off", "reversed"])
def test_every_thruster_that_is_off_or_reversed_is_found_and_no_other(which):
    assert not healthy()[0].lost.any()
    np.testing.assert_array_equal(lost_after()[which], np.eye(8))


@pytest.mark.full
def test_two_thrusters_that_are_off_at_once_are_both_found():
    lost = lost_after()[2]
    found = lost.any(1)
    np.testing.assert_array_equal(lost[found], PAIRS[found])
    assert found.sum() >= 24  # the others accelerate the vehicle as another pair does


@pytest.mark.full
def test_two_thrusters_that_fail_together_are_both_found():
    fails = np.isin(np.arange(8), (0, 5))
    state, _ = later(healthy(), 50, ~fails)
    np.testing.assert_array_equal(state.lost, fails.astype(float))


# Volts of thrusters that give 3 to 5 % of their largest force, less than the first examination pays attention to.
GENTLE = np.stack([np.zeros(8), [2.0, -2.2, 2.0, -2.2, 2.0, -2.2, 2.2, -2.0]])


def test_a_small_force_that_ends_is_found_whenever_that_is_between_two_examinations():
    fails, step = np.arange(8) == 1, 8
    before = followed(*start(), 0, WARM, GENTLE, np.ones(8), NONE)
    for first in range(WARM, WARM + 30, step):
        assert not before[0].lost.any()
        state, _ = followed(*before, first, 150, GENTLE, 1.0 - fails, NONE)
        np.testing.assert_array_equal(state.lost, fails.astype(float))
        before = followed(*before, first, step, GENTLE, np.ones(8), NONE)


def test_what_is_lost_stays_lost_and_a_sudden_load_is_no_thruster():
    fails = np.arange(8) == 2
    state, nu = later(healthy(), 50, ~fails)
    np.testing.assert_array_equal(state.lost, fails.astype(float))
    is_as_recorded("monitor: 0.5 s after a thruster has failed", (state, nu))
    state, nu = later((state, nu), 500, ~fails, first=WARM + 50)
    np.testing.assert_array_equal(state.lost, fails.astype(float))
    is_as_recorded("monitor: 5 s later", (state, nu))
    pushed, _ = later(healthy(), 200, np.ones(8), load=np.eye(6)[2])
    is_as_recorded("monitor: a sudden load", pushed)
    assert not pushed.lost.any()


@pytest.mark.full
def test_a_propeller_that_reports_no_speed_is_lost():
    monitor, model = monitor_of(speed_sensor=True, settling=0.0)
    u = 8.0 * jnp.ones(8)
    state = monitor.init(model, at(jnp.zeros(6), PropellerReport(jnp.zeros(8), None)))
    speeds = jnp.zeros(8)
    step = jax.jit(lambda state, y: monitor.advance(state, model, y, u, 1 - state.lost, jnp.asarray(DT)))
    for _ in range(40):
        state = step(state, at(jnp.zeros(6), PropellerReport(speeds, None)))
        speeds = state.unreported.speed.at[5].set(0.0)
    np.testing.assert_array_equal(state.lost, np.arange(8) == 5)


def test_a_reading_that_is_not_finite_leaves_the_state_finite():
    state, nu = start()
    volts = np.stack([np.zeros(8), np.ones(8)])
    state, _ = followed(state, np.where(np.arange(6) == 0, np.nan, nu), 0, 1, volts, np.ones(8), NONE)
    state, _ = followed(state, nu, 1, 1, volts, np.ones(8), NONE)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(state))


def test_errors_name_the_option():
    law = pid(ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.t200()).model(), sampling_time=DT)
    with pytest.raises(BadInput, match=r"`threshold` must be positive, but is -1"):
        fault_tolerant(law, DT, threshold=-1.0)
    with pytest.raises(BadInput, match=r"`treshold` must be one of background_time, .*threshold"):
        fault_tolerant(law, DT, treshold=4.0)
    with pytest.raises(BadInput, match=r"`sampling_time` must be positive, but is 0 s"):
        fault_tolerant(law, 0.0)
