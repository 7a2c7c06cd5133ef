"""One undertow controller controls MuJoCo's vehicle and undertow's: the same motion."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.core.status import Status
from undertow.outside.mujoco_engine import Submerged, UniformFlow, run_in_mujoco
from undertow.outside.mujoco_engine.mujoco_run import Propellers
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

FLOW = [0.2, -0.1, 0.0]


@pytest.fixture(scope="module")
def parts():
    thruster = ut.thrusters.t200(supply=16.0)
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), thruster, ledger=False)
    law = ut.rcaf(
        plant.model(rate_term=True),
        preset="paper",
        feedback=[[4, 7]] * 3 + [[20, 13]] * 3,
        pole=[4, 4, 4, 3, 3, 3],
        adaptation=[0.15] * 3 + [0.05] * 3,
        composite=[150] * 3 + [200] * 3,
        robust_gain=0.1,
        compensation_gain=0,
        weights_bound=40,
    )
    return plant, thruster, law, ut.references.setpoint([1, 0.5, 0.5, 0, 0, 0.5], settling=4.0)


@pytest.mark.slow
def test_closed_loops_agree(parts):
    """Five seconds in a current at 100 Hz: 1e-8 m and rad, 1e-6 V, mostly of undertow's steps of 10 ms."""
    plant, thruster, law, reference = parts
    current = ut.disturbances.current(FLOW)
    loop = ClosedLoop(plant, law, reference, current, ut.navigation.perfect())
    run = sampled.simulate(loop, duration=5.0, dt=0.01, record_every=1)
    body = Submerged(plant.vehicle, water=UniformFlow(FLOW))
    mujoco_run = run_in_mujoco(body, thruster, law, reference, duration=5.0, dt=0.01)
    assert mujoco_run.status == Status.OK
    np.testing.assert_allclose(mujoco_run.time, run.time, atol=1e-12)
    assert np.ptp(mujoco_run.position[:, 0]) > 0.9 and np.abs(mujoco_run.voltage).max() > 3
    np.testing.assert_allclose(mujoco_run.position, run.signals["position"], atol=1e-7)
    np.testing.assert_allclose(mujoco_run.velocity, run.signals["velocity"], atol=1e-6)
    np.testing.assert_allclose(mujoco_run.voltage, run.signals["input"], atol=1e-5)


def test_runs_repeat_bit_for_bit(parts):
    plant, thruster, law, reference = parts
    first, second = (run_in_mujoco(Submerged(plant.vehicle), thruster, law, reference, duration=0.5) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("kind", ["pass", "subtract"])
def test_propellers_turn_as_undertows_do(kind):
    """Both directions, reversal, dead zone, supply: 0.4 s at one voltage, then 0.4 s at another."""
    thruster = ut.thrusters.t200(supply=16.0, dead_zone_kind=kind)
    voltages = np.array([[16.0, -16, 8, -8, 1, 0, 12, 20], [-16.0, 5, 10, -0.5, 1.3, 3, 0, -20]])
    ours, state = Propellers(thruster, 8), thruster.initial_state(8)
    for asked in voltages:
        given = ours.admissible(asked)
        assert np.abs(given).max() == 16.0
        thrusts = ours.turn(given, 0.4, 400)
        held = jnp.asarray(given)
        step = lambda k, s, held=held: rk4(lambda t, s: thruster.dynamics(s, held), jnp.zeros(()), s, jnp.asarray(1e-3))
        state = jax.lax.fori_loop(0, 400, step, state)
        np.testing.assert_allclose(ours.speed, state.speed, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(thrusts[-1], thruster.thrust(state, held), rtol=1e-12, atol=1e-12)


def test_propellers_at_once():
    thruster = ut.thrusters.t200("static", supply=20.0)
    volts = np.array([20.0, -20, 5, -5, 1, 0])
    thrusts = Propellers(thruster, 6).turn(volts, 0.01, 2)
    np.testing.assert_allclose(thrusts, np.tile(thruster.thrust((), jnp.asarray(volts)), (3, 1)), rtol=1e-13)


def test_a_run_that_fails_says_so(parts):
    """A feedback far too fast for the motor: the loop is unstable in both worlds."""
    plant, _, _, reference = parts
    wild = ut.rcaf(plant.model(rate_term=True), preset="paper", composite=5e4, adaptation=1e4)
    mujoco_run = run_in_mujoco(Submerged(plant.vehicle), ut.thrusters.t200(supply=1e5), wild, reference, duration=20.0)
    assert mujoco_run.status in (Status.DIVERGED, Status.NOT_FINITE)
    assert 0 < len(mujoco_run.time) < 2001 and np.isfinite(mujoco_run.position).all()


def test_what_does_not_fit_is_refused(parts):
    plant, thruster, law, reference = parts
    with pytest.raises(BadInput, match=r"`dt` must be a whole number of the engine's steps \(0.004 s\)"):
        run_in_mujoco(Submerged(plant.vehicle, timestep=4e-3), thruster, law, reference)
    with pytest.raises(BadInput, match="`thruster` must be on fidelity `shaft` or `static`, but is Memoryless"):
        run_in_mujoco(Submerged(plant.vehicle), ut.thrusters.linear_voltage(), law, reference)
    with pytest.raises(BadInput, match="`added_mass` must be one of force, body, but is ghost"):
        Submerged(plant.vehicle, added_mass="ghost")
    with pytest.raises(BadInput, match=r"`velocity` must have 3 entries \(north, east, down\), but is 2 long"):
        Submerged(plant.vehicle, water=UniformFlow([0.1, 0.2]))
