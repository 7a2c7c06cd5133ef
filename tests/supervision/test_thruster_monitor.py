"""The residual of the monitor in closed form, and what it makes of it."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.controllers.pid import pid
from undertow.core.contracts import BodyMotion, Measurement
from undertow.core.errors import BadInput
from undertow.supervision.fault_tolerant_law import fault_tolerant
from undertow.thrusters.thruster import PropellerReport

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
    return Measurement(jnp.zeros(6), nu, report, BodyMotion(jnp.asarray([1.0, 0.0, 0.0, 0.0]), jnp.eye(3), nu))


def followed(watched, input_of, force_of_plant, steps, load=None, start=None, used=None):
    """State after steps of a body whose velocity obeys the nominal model with other forces, in Euler's steps."""
    monitor, model = watched
    dynamics, load = model.dynamics, jnp.zeros(6) if load is None else load
    used = jnp.ones(8) if used is None else used

    def step(k, carry):
        state, nu = carry
        y, u = at(nu), input_of(k)
        rate = dynamics.drift(y) + dynamics.gain(y) @ force_of_plant(k, model.actuators.force((), u)) + load
        return monitor.advance(state, model, y, u, used * (1 - state.lost), jnp.asarray(DT)), nu + DT * rate

    first = (monitor.init(model, at(jnp.zeros(6))), jnp.zeros(6)) if start is None else start
    return jax.lax.fori_loop(0, steps, step, first)


def test_the_residual_is_the_unexplained_acceleration_behind_two_low_passes():
    monitor, load = monitor_of(), jnp.asarray([0.2, -0.1, 0.3, 0.05, -0.4, 0.1])
    steps = 12
    state, _ = followed(monitor, lambda k: 3.0 * jnp.ones(8), lambda k, f: f, steps, load)
    share, one, two = 1 - np.exp(-15.0 * DT), 0.0, 0.0
    for _ in range(steps):
        two, one = two + share * (one - two), one + share * (1.0 - one)
    np.testing.assert_allclose(state.residual, two * load, rtol=1e-9)
    assert not state.lost.any()


def changing(k):
    """Volts of eight thrusters, each above 4 V."""
    return jnp.asarray([5.0, -6.0, 5.5, -7.0, 6.0, -5.0, 7.0, -6.5]) + 0.5 * jnp.sin(0.05 * k + jnp.arange(8.0))


@pytest.mark.parametrize("share", [0.0, -1.0])
def test_every_thruster_that_is_off_or_reversed_is_found_and_no_other(share):
    monitor = monitor_of()
    healthy = followed(monitor, changing, lambda k, f: f, WARM)
    assert not healthy[0].lost.any()

    def failed(which):
        fails = jnp.arange(8) == which
        later = lambda k: changing(k + WARM)
        return followed(monitor, later, lambda k, f: jnp.where(fails, share * f, f), 50, start=healthy)[0].lost

    np.testing.assert_array_equal(jax.vmap(failed)(jnp.arange(8)), np.eye(8))


def test_two_thrusters_that_are_off_at_once_are_both_found():
    monitor = monitor_of()
    healthy = followed(monitor, changing, lambda k, f: f, WARM)

    def failed(off):
        later = lambda k: changing(k + WARM)
        return followed(monitor, later, lambda k, f: f * (1 - off), 50, start=healthy)[0].lost

    pairs = np.array([np.isin(np.arange(8), pair) for pair in itertools.combinations(range(8), 2)]).astype(float)
    lost = np.asarray(jax.vmap(failed)(jnp.asarray(pairs)))
    found = lost.any(1)
    np.testing.assert_array_equal(lost[found], pairs[found])
    assert found.sum() >= 24  # the others accelerate the vehicle as another pair does


def test_what_is_lost_stays_lost_and_a_sudden_load_is_no_thruster():
    monitor = monitor_of()
    fails = jnp.arange(8) == 2
    state, nu = followed(monitor, changing, lambda k, f: f, WARM)
    state, nu = followed(monitor, changing, lambda k, f: jnp.where(fails, 0.0, f), 50, start=(state, nu))
    assert state.lost[2] == 1.0
    state, nu = followed(monitor, changing, lambda k, f: jnp.where(fails, 0.0, f), 500, start=(state, nu))
    np.testing.assert_array_equal(state.lost, fails.astype(float))
    healthy = followed(monitor, changing, lambda k, f: f, WARM)
    pushed, _ = followed(monitor, changing, lambda k, f: f, 200, load=jnp.zeros(6).at[2].set(1.0), start=healthy)
    assert not pushed.lost.any()


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
    monitor, model = monitor_of()
    state = monitor.init(model, at(jnp.zeros(6)))
    state = monitor.advance(
        state, model, at(jnp.zeros(6).at[0].set(jnp.nan)), jnp.ones(8), jnp.ones(8), jnp.asarray(DT)
    )
    state = monitor.advance(state, model, at(jnp.zeros(6)), jnp.ones(8), jnp.ones(8), jnp.asarray(DT))
    assert all(jnp.isfinite(leaf).all() for leaf in jax.tree.leaves(state))


def test_errors_name_the_option():
    law = pid(ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.t200()).model(), sampling_time=DT)
    with pytest.raises(BadInput, match=r"`threshold` must be positive, but is -1"):
        fault_tolerant(law, DT, threshold=-1.0)
    with pytest.raises(BadInput, match=r"`treshold` must be one of background_time, .*threshold"):
        fault_tolerant(law, DT, treshold=4.0)
    with pytest.raises(BadInput, match=r"`sampling_time` must be positive, but is 0 s"):
        fault_tolerant(law, 0.0)
