"""A reading that is no number costs a run nothing but itself; a command that is none ends it with its cause."""

import dataclasses
from functools import cache, partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.pid import pid
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.observer import observer
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core import runtime
from undertow.core.contracts import AbstractContinuousController, AbstractController, AbstractNavigation, Model
from undertow.core.measurement import measurement_of_outputs
from undertow.core.status import Status
from undertow.physics.disturbances.none import none
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.sensors import compass, dvl, imu, position_fix
from undertow.physics.sensors.depth import Depth
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.thrusters import paper_table3, t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import continuous, sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.prepared_run import PreparedRun
from undertow.simulation.run_many import run_together

DT = 0.01
NAN, INF = float("nan"), float("inf")
AMPLITUDE, FREQUENCY = 0.5, 1.0  # of the load, m/s^2 and rad/s
BACK_ENDS = {"xla": sampled.simulate, "simd": simd_batch.simulate}
LAWS = {
    "robust": lambda model: rcaf(model, preset="robust", sampling_time=DT, bandwidth=0.35 / DT),
    "pid": lambda model: pid(model, sampling_time=DT, frequency=3.0),
    "paper": lambda model: rcaf(model, preset="paper", pole=20.0, composite=20.0, adaptation=5.0, weights_bound=20.0),
}


class Faulty(AbstractNavigation):
    """The truth, but for some entries (of position, then velocity) that are something else from a time to another."""

    entries: jax.Array = eqx.field(converter=jnp.asarray)  # 1 for those that fail
    value: jax.Array = eqx.field(converter=jnp.asarray)
    first: jax.Array = eqx.field(converter=jnp.asarray)  # s
    last: jax.Array = eqx.field(converter=jnp.asarray)  # s
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key):
        return ()

    def init(self, path, truth):
        return ()

    def measure(self, path, state, t, truth):
        now = (t > self.first - DT / 2) & (t < self.last - DT / 2)
        told = jnp.concatenate([truth.position, truth.velocity])
        told = jnp.where(now & (self.entries > 0), self.value, told)
        n = truth.position.shape[0]
        return truth._replace(position=told[:n], velocity=told[n:]), ()


def run(law, sensor, simulate=sampled.simulate, duration=6.0, load=None):
    plant = double_integrator(2, 20.0)
    load = sinusoid(AMPLITUDE, FREQUENCY) if load is None else load
    loop = ClosedLoop(plant, LAWS[law](plant.model()), setpoint(np.array([0.3, -0.2])), load, sensor)
    return jax.tree.map(np.asarray, simulate(loop, duration=duration, dt=DT, record_every=1))


@pytest.mark.parametrize(
    ("law", "back_end"),
    [
        pytest.param("robust", "simd", marks=pytest.mark.full),
        pytest.param("pid", "xla", marks=pytest.mark.full),
        pytest.param("paper", "simd", marks=pytest.mark.full),
        pytest.param("robust", "xla", marks=pytest.mark.slow),
        pytest.param("pid", "simd", marks=pytest.mark.slow),
        pytest.param("paper", "xla", marks=pytest.mark.slow),
    ],
)
def test_a_gap_costs_what_the_load_changes_meanwhile(law, back_end):
    """In T seconds without a reading the motion departs from the foreseen one by at most d_til T^2 / 2 + |d_dot| T^3 / 6."""
    simulate, gap, at = BACK_ENDS[back_end], 0.3, 3.0
    sound = run(law, Faulty(np.ones(4), 1.0, 99.0, 99.0), simulate)
    missed = run(law, Faulty(np.ones(4), NAN, at, at + gap), simulate)
    assert (Status(int(missed.status)), float(missed.ended)) == (Status.OK, 6.0)
    steps, begin = round(gap / DT), round(at / DT)
    counts = np.asarray(missed.signals["bad_readings"])
    assert counts[begin - 1] == 0 and counts[begin] == 1 and (counts[begin + steps :] == steps).all()
    assert (np.asarray(sound.signals["bad_readings"]) == 0).all()
    wrong = np.abs(sound.signals["estimate"][begin] - sound.signals["uncertainty"][begin]).max()
    allowed = wrong * gap**2 / 2 + AMPLITUDE * FREQUENCY * gap**3 / 6
    told = np.abs(missed.signals["measured_position"] - missed.signals["position"])[begin : begin + steps]
    assert 0 < told.max() <= 1.1 * allowed
    later = np.abs(missed.signals["position"] - sound.signals["position"])
    assert later.max() <= 3 * allowed, "and it is taken back afterwards"
    np.testing.assert_array_equal(missed.signals["position"][:begin], sound.signals["position"][:begin])
    if law == "robust":  # what it has learnt stays what it was
        learnt = np.asarray(missed.signals["estimate"])[begin : begin + steps]
        assert np.abs(learnt - learnt[0]).max() < 0.05 * AMPLITUDE


@cache
def unhurt():
    """The run without a bad reading."""
    return run("robust", Faulty(np.ones(4), NAN, 1.0, 1.0), load=none(), duration=2.0)


@pytest.mark.parametrize("value", [NAN, INF, -INF, 1e200])
@pytest.mark.parametrize("entry", range(4))
def test_one_bad_number_changes_nothing_to_speak_of(entry, value):
    """Whatever it is and wherever it stands; a good neighbour is still used. Without a load nothing is foreseen wrongly."""
    one = (np.arange(4) == entry).astype(float)
    sound, hit = unhurt(), run("robust", Faulty(one, value, 1.0, 1.0 + DT), load=none(), duration=2.0)
    assert Status(int(hit.status)) is Status.OK and int(hit.signals["bad_readings"][-1]) == 1
    assert np.abs(hit.signals["position"] - sound.signals["position"]).max() < 20.0 * DT**2 / 2
    other = [axis for axis in range(2) if axis != entry % 2]
    np.testing.assert_allclose(hit.signals["position"][:, other], sound.signals["position"][:, other], rtol=1e-12)


@pytest.mark.full
def test_the_very_first_reading():
    """The law knows where it was put: a start in the dark is that of a law that sees."""
    sound, dark = (run("robust", Faulty(np.ones(4), NAN, 0.0, end), load=none(), duration=1.0) for end in (0.0, DT))
    np.testing.assert_array_equal(dark.signals["commanded_input"][0], sound.signals["commanded_input"][0])
    assert int(dark.signals["bad_readings"][0]) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("law", "within"), [("robust", 1e-2), ("pid", 3e-2)])
def test_a_vehicle_in_its_own_axes(law, within):
    """Half a second without attitude and velocities, turning and pitching, costs a hundredth of a radian.

    Of a PID it costs more: its integral, on the way, is no estimate of a load.
    """
    plant = hybrid_vehicle(bluerov2_heavy(), t200(fidelity="static", dead_zone=0.0), ledger=False)
    navigation = Faulty(np.repeat([0.0, 1.0], [3, 9]), NAN, 1.0, 1.0)
    goal = setpoint([1.0, 0.5, 1.0, 0.1, 0.2, 1.0])
    loop = ClosedLoop(plant, LAWS[law](plant.model()), goal, none(), navigation)
    start = loop.outputs_at_start(None, np.array([0.3, 0, 0, 0, 0.2, 0.5]))
    # Both in one batch, which is compiled once; Euler's method, as only the difference between the two matters.
    plan = RunPlan(300, DT, 1, ("position", "bad_readings"), "euler")
    until = lambda last: dataclasses.replace(loop, navigation=Faulty(np.repeat([0.0, 1.0], [3, 9]), NAN, 1.0, last))
    runs = [LoopRun(until(last), (), start, jax.random.PRNGKey(0)) for last in (1.0, 1.5)]
    found = run_together([PreparedRun(run, plan, precision=runtime.current_precision()) for run in runs])
    np.testing.assert_array_equal(found.status, int(Status.OK))
    np.testing.assert_array_equal(found.signals["bad_readings"][:, -1], [0, 50])
    sound, hit = found.signals["position"]
    assert np.abs(sound[150, 3:] - sound[100, 3:]).max() > 0.1, "it turns meanwhile"
    assert 0 < np.abs(hit - sound).max() < within


class Broken(AbstractContinuousController):
    """A spring, but for one input that is something else from a time on; the clock is the position of an axis."""

    model: Model
    value: jax.Array = eqx.field(converter=jnp.asarray)
    after: jax.Array = eqx.field(converter=jnp.asarray)
    method: str = eqx.field(static=True, default="euler")
    substeps: int = eqx.field(static=True, default=1)

    def init(self, y, r):
        return jnp.zeros(())

    def command(self, z, y, r):
        u = -y.position - y.velocity
        u = u.at[1].set(jnp.where(z > self.after, self.value, u[1]))
        return u, {}

    def signals(self):
        return {}

    def flow(self, z, y, r, u_applied):
        return jnp.ones(())

    def project(self, z):
        return z


def broken(value, after=0.5):
    plant = double_integrator(2, 20.0)
    return ClosedLoop(plant, Broken(plant.model(), value, after), setpoint(np.ones(2)), sinusoid(), perfect())


WAYS = {
    "xla": partial(sampled.simulate, duration=1.0, dt=DT),
    "simd": partial(simd_batch.simulate, duration=1.0, dt=DT),
    "continuous": partial(continuous.simulate, duration=1.0, dt=DT, record_step=0.1),
}


@cache
def whole_run(way):
    """The run whose commands are all numbers."""
    return WAYS[way](broken(1.0))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("value", [NAN, INF, -INF])
def test_a_command_that_is_no_number_ends_the_run(way, value):
    """Limits would make 20 of what is infinite. Time and input are told; what was there before is kept."""
    whole, cut = whole_run(way), WAYS[way](broken(value, after=0.5 - DT / 2))
    assert Status(int(whole.status)) is Status.OK and int(whole.input) == 0
    assert Status(int(cut.status)) is Status.COMMAND_NOT_FINITE
    # The clock of the law is a step of Euler's method behind, or within one of Runge and Kutta's.
    assert float(cut.ended) == pytest.approx(0.5, abs=0 if way != "continuous" else DT)
    assert int(cut.input) == 2 and "input 2, at 0." in cut.sentence()
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(cut.final))


@pytest.mark.slow
def test_the_adaptive_integrator_says_so_too():
    cut = continuous.simulate(broken(NAN, after=-1.0), duration=1.0, record_step=0.1, tolerances=(1e-6, 1e-8))
    assert (Status(int(cut.status)), int(cut.input)) == (Status.COMMAND_NOT_FINITE, 2)


class Mute(AbstractController):
    """No input but what is no number."""

    model: Model

    def init(self, y, r):
        return jnp.zeros(())

    def command(self, z, y, r):
        return jnp.full(self.model.dynamics.gain(y).shape[1], NAN), {}

    def signals(self):
        return {}

    def advance(self, z, y, r, u_applied, dt):
        return z


@pytest.mark.full
def test_behind_a_dead_zone():
    """The dead zone of a thruster made 0 V of it, and the run ended as ok."""
    thruster = paper_table3(fidelity="static", dead_zone=1.0)
    np.testing.assert_array_equal(thruster.terminal(jnp.array([NAN, 0.5, -1.0, 1.5, -INF])), [NAN, 0.0, 0.0, 1.5, -INF])
    plant = hybrid_vehicle(bluerov2_heavy(), thruster)
    loop = ClosedLoop(plant, Mute(plant.model()), setpoint(np.zeros(6)), none(), perfect())
    cut = sampled.simulate(loop, duration=0.1, dt=DT, record_every=1)
    assert (Status(int(cut.status)), float(cut.ended), int(cut.input)) == (Status.COMMAND_NOT_FINITE, 0.0, 1)


class Flooded(Depth):
    """Reads nothing below a depth."""

    def reading(self, motion):
        return jnp.where(motion.position[2:3] > 0.5, jnp.nan, motion.position[2:3])


@pytest.mark.full
def test_navigation_leaves_out_readings_that_are_none():
    """As if they were lost: the estimate goes on, each is counted, and the depth is known again afterwards."""
    quiet = [imu(angle_noise=0, rate_noise=0, force_noise=0), dvl(noise=0, resolution=0, delay=0), compass(noise=0)]
    sensor = observer([*quiet, position_fix(noise=0, delay=0), Flooded(Sampling(0.05))])
    motion = lambda t: measurement_of_outputs(jnp.zeros(6).at[2].set(jnp.sin(t)), jnp.zeros(6).at[2].set(jnp.cos(t)))
    path = sensor.realize(jax.random.PRNGKey(0))

    def step(state, t):
        told, state = sensor.measure(path, state, t, motion(t))
        return state, (told.position, sensor.ignored(state))

    times = jnp.arange(700, dtype=float) * DT
    found, ignored = jax.lax.scan(step, sensor.init(path, motion(0.0)), times)[1]
    wet = np.asarray(jnp.sin(times))[::5] > 0.5
    assert int(ignored[-1]) == wet.sum() > 30
    assert np.abs(np.asarray(found)[:, 2] - np.asarray(jnp.sin(times))).max() < 0.02
