"""A supervised controller in closed loop: the bits of its law where nothing is wrong, and no jump at any transfer."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.control.supervision.conditions import Request, State
from undertow.control.supervision.supervisor import supervisor
from undertow.control.supervision.transition_log import transitions
from undertow.core import runtime
from undertow.core.numerics.integrators import METHODS
from undertow.report.signal_names import lost_thrusters
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.sampled import integrate_plant

pytestmark = pytest.mark.full

HEAVY = {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}}
GOAL = {"kind": "setpoint", "position": [1, 1, 1, 0, 0, 0.5]}
SEA = [{"kind": "current", "velocity": [0.2, 0.1, 0]}, {"kind": "waves", "height": 0.3}]
SCENARIOS = {
    "robust": {
        "plant": HEAVY,
        "controller": {"kind": "rcaf", "preset": "robust"},
        "reference": GOAL,
        "disturbance": SEA,
    },
    "pid": {"plant": HEAVY, "controller": "pid", "reference": GOAL, "navigation": {"kind": "white_noise"}},
    "paper": {
        "controller": {"kind": "paper", "composite": 20, "weights_bound": 20},
        "reference": {"kind": "setpoint", "position": [2, 3, 4, 1, 0.8, 1.2]},
        "disturbance": "u1",
        "loop": {"dt": 1e-3},
    },
    "pendulum": {
        "plant": {"kind": "inverted_pendulum"},
        "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 0.5},
        "loop": {"dt": 1e-3},
    },
}


def _outcome(scenario, duration=3.0):
    built = build(from_data(scenario | {"loop": {"dt": 0.01, "duration": duration} | scenario.get("loop", {})}))
    with runtime.on_processor(), runtime.in_precision("float64"):
        return simd_batch.simulate(built.closed_loop, duration=duration, dt=built.scenario.loop.dt, record_every=1)


@pytest.mark.parametrize("name", SCENARIOS)
def test_where_nothing_is_wrong_a_run_has_the_same_bits(name):
    alone, watched = _outcome(SCENARIOS[name]), _outcome(SCENARIOS[name] | {"supervisor": True})
    for signal in set(alone.signals) - {"commanded_input"}:
        np.testing.assert_array_equal(watched.signals[signal], alone.signals[signal], err_msg=signal)
    state = np.asarray(watched.signals["supervisor_state"])
    assert (state == int(State.ACTIVE)).all()
    assert [str(one) for one in transitions(watched.final[1].log)] == ["0 s: READY", "0 s: ACTIVE"]


T = 0.02


class Controlled:
    """A supervised vehicle, stepped by the test, that an operator's requests reach."""

    def __init__(self):
        plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200(supply=16.0))
        law = ut.rcaf(plant.model(), preset="robust", sampling_time=T)
        fallback = ut.controllers.pid(plant.model(), sampling_time=T)
        self.supervised = supervisor(law, plant, fallback, sampling_time=T)
        self.parts = (plant, self.supervised, ut.references.setpoint(np.array([2.0, 1, 1, 0, 0, 1])))
        # With the parts inside, a call takes a third of the time that it takes with the parts as arguments.
        self.compiled = jax.jit(functools.partial(_step, self.parts))
        x = plant.initial_state()
        self.begun = jax.tree.map(np.asarray, (x, _begun(self.parts, x)))

    def restart(self):
        self.x, self.z = self.begun

    def step(self, request: Request):
        self.z = self.z._replace(request=np.asarray(int(request)))
        self.x, self.z, output = self.compiled(self.x, self.z)
        return np.asarray(output)


@functools.cache
def controlled():
    """A BlueROV2 Heavy whose law and fallback find failed thrusters."""
    return Controlled()


@eqx.filter_jit
def _begun(parts, x):
    plant, supervised, target = parts
    return supervised.init(plant.output(jnp.zeros(()), x), target.at(jnp.zeros(())))


def _step(parts, x, z):
    plant, supervised, target = parts
    t = jnp.zeros(())
    y, r = plant.output(t, x), target.at(t)
    u, _ = supervised.command(z, y, r)
    applied = plant.admissible(x, u)
    new = integrate_plant(
        lambda t, x: plant.dynamics(t, x, applied, plant.no_load()), t, x, jnp.asarray(T), METHODS["rk4"], 1
    )
    return new, supervised.advance(z, y, r, applied, jnp.asarray(T)), u


def test_a_thousand_transfers_make_no_jump():
    run, chance = controlled(), np.random.default_rng(0)
    run.restart()
    most = float(run.supervised.slew) * 32.0 * T
    before, request, seen, largest, transfers = run.step(Request.RUN), Request.RUN, set(), 0.0, 0
    for _ in range(1000):
        request = Request(int(chance.choice([r for r in (0, 1, 3, 4) if r != request])))
        whom = None
        for _ in range(chance.integers(2, 6)):
            controls = run.z.state in (State.ACTIVE, State.DEGRADED)
            transfers += whom is not None and whom != (controls, bool(run.z.fallback_controls))
            whom = (controls, bool(run.z.fallback_controls))
            in_transfer = bool(run.z.transfer) or not controls
            output = run.step(request)
            largest = max(largest, np.abs(output - before).max() if in_transfer else 0.0)
            before = output
        seen.add((State(int(run.z.state)), bool(run.z.fallback_controls)))
    assert largest <= most * (1 + 1e-12)
    assert transfers > 500
    assert {(State.READY, False), (State.READY, True), (State.ACTIVE, True), (State.ACTIVE, False)} <= seen


def test_stopped_is_for_good():
    run = controlled()
    run.restart()
    for _ in range(5):
        run.step(Request.RUN)
    run.step(Request.STOP)
    for _ in range(60):
        output = run.step(Request.RUN)
    assert run.z.state == int(State.STOPPED)
    assert (output == 0).all()
    assert transitions(run.z.log)[-1].reason == "operator"


def _with_a_dead_thruster(thruster, onset, **changes):
    """A supervised BlueROV2 that keeps its place while a thruster dies: its run, and the one loss that was found."""
    run = ut.simulate_scenario(
        {
            "plant": {"vehicle": "bluerov2", "thruster": {"kind": "t200", "supply": 16}},
            "supervisor": True,
            "reference": {"kind": "setpoint", "position": [0] * 6},
            "faults": [{"target": f"thruster {thruster}", "mode": "off", "onset": onset}],
            **changes,
        }
    ).dataset
    (loss,) = lost_thrusters(run)
    return run, loss


@pytest.mark.full
def test_a_law_of_low_bandwidth_does_not_hide_a_dead_thruster():
    run, (name, time) = _with_a_dead_thruster(
        2,
        15,
        controller={"kind": "pid", "frequency": 1.0},
        disturbance={"kind": "current", "velocity": [0, 0.3, 0]},
        loop={"dt": 0.01, "duration": 18, "record": 0.05},
    )
    assert name.startswith("T2") and 15 < time < 16.5
    assert np.rad2deg(np.abs(run["error"].sel(axis="yaw")).max()) < 10  # 64 degrees in 15 s if it is not found


@pytest.mark.full
def test_an_integral_survives_the_loss_of_a_thruster():
    """The pitch that a BlueROV2 cannot give has wound up nothing when the thrusters that are left share the work."""
    run, (name, _) = _with_a_dead_thruster(
        3,
        20,
        controller="lqi",
        disturbance={"kind": "current", "velocity": [0.2, 0.1, 0]},
        loop={"dt": 0.02, "duration": 60, "record": 0.1},
    )
    assert name.startswith("T3")
    assert np.abs(run["position"].values[:, :3]).max() < 0.05  # 2.6 m where it has
