"""Thrusters with limits that differ forward and in reverse: those commanded in newtons, and `first_order`."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import linprog

from simdjit import Loop
from undertow.analysis.metrics import Metrics, results
from undertow.control.controllers import pid, rcaf
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import AbstractController, Model, Target
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.numerics.integrators import rk4
from undertow.physics.disturbances import none
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.power import battery
from undertow.physics.thrusters import commanded_thrust, first_order
from undertow.physics.vehicles import bluerov2_heavy, odin
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

FORWARD, REVERSE = 30.0, 12.0  # N
ONE_TO_FOUR = commanded_thrust(FORWARD, REVERSE, time_constant=0.1)
LAWS = {"robust": lambda model, **how: rcaf(model, preset="robust", **how), "pid": pid}


def settle(thruster, command, duration, start=None, dt=1e-3):
    """State a time after a command, from rest or from where it starts."""
    command = np.asarray(command)
    start = thruster.initial_state(command.size) if start is None else start
    return _settle(thruster, command, start, np.asarray(dt), np.asarray(round(duration / dt)))


@eqx.filter_jit
def _settle(thruster, command, start, dt, steps):
    step = lambda _, state: rk4(lambda t, x: thruster.dynamics(x, command), 0.0, state, dt)
    return jax.lax.fori_loop(0, steps, step, start)


def test_step_response():
    """T = T_c (1 - exp(-t / tau))."""
    for t in (0.05, 0.1, 0.37):
        found = settle(ONE_TO_FOUR, [-9.0, 5.0, 20.0], t).thrust
        np.testing.assert_allclose(found, np.array([-9.0, 5.0, 20.0]) * (1 - np.exp(-t / 0.1)), rtol=1e-9)


def test_rate_limit():
    """At first as fast as the limit, from |T_c - T| = rate tau on as the lag."""
    thruster = commanded_thrust(FORWARD, REVERSE, time_constant=0.1, thrust_rate_max=50.0)
    meeting = (20.0 - 50.0 * 0.1) / 50.0  # s
    for t in (0.1, 0.2, meeting, 0.5):
        expected = 50.0 * t if t <= meeting else 20.0 - 5.0 * np.exp(-(t - meeting) / 0.1)
        # The step that meets the lag is not smooth.
        np.testing.assert_allclose(settle(thruster, [20.0], t).thrust, expected, rtol=1e-6)


def test_each_side_is_clipped_at_its_own_limit():
    plant = hybrid_vehicle(odin(), ONE_TO_FOUR)
    asked = np.array([-50.0, -12.0, -11.0, 0.0, 12.0, 29.0, 30.0, 50.0])
    x = plant.initial_state()

    @jax.jit
    def evaluate(asked):
        given = plant.admissible(x, asked)
        return given, plant.effort(x, given)

    given, effort = jax.tree.map(np.asarray, evaluate(asked))
    np.testing.assert_array_equal(given, [-12.0, -12.0, -11.0, 0.0, 12.0, 29.0, 30.0, 30.0])
    np.testing.assert_array_equal(effort.saturated, [1, 1, 0, 0, 0, 0, 1, 1])
    np.testing.assert_allclose(effort.power, 7.6 * np.abs(given))
    assert plant.input_unit == "N"
    asked[3] = np.nan
    assert np.isnan(evaluate(asked)[0][3])


class Asking(AbstractController):
    """A law that asks for the same whatever happens."""

    model: Model
    asked: jax.Array
    inner: AbstractController

    def init(self, y, r):
        return self.inner.init(y, r)

    def command(self, z, y, r):
        return self.asked, self.inner.command(z, y, r)[1]

    def signals(self):
        return self.inner.signals()

    def advance(self, z, y, r, u_applied, dt):
        return self.inner.advance(z, y, r, u_applied, dt)


@pytest.mark.slow
def test_metrics_count_each_limit():
    """Two of eight thrusters are at a limit, one forward and one in reverse; peak and rms are of what was applied."""
    plant = hybrid_vehicle(odin(), ONE_TO_FOUR)
    asked = jnp.array([100.0, -100.0, 15.0, -11.0, 0.0, 0.0, 0.0, 0.0])
    law = Asking(plant.model(), asked, pid(plant.model(), sampling_time=0.02))
    loop = ClosedLoop(plant, law, setpoint([0.0] * 6), none(), perfect())
    run = sampled.simulate(
        loop, duration=1.0, dt=0.02, record_every=5, accumulators=(Metrics(0.0, 1.0),), method="euler"
    )
    found = results((Metrics(0.0, 1.0),), run.accumulated)
    assert found["saturated_fraction"] == pytest.approx(2 / 8)
    assert found["input_peak"] == pytest.approx(FORWARD)
    assert found["input_rms"] == pytest.approx(np.sqrt((30**2 + 12**2 + 15**2 + 11**2) / 8))
    assert found["energy"] == pytest.approx(7.6 * (30 + 12 + 15 + 11) * 0.98, rel=1e-9), "50 samples"


def test_what_cannot_be():
    for name in ("thrust_forward_max", "thrust_reverse_max", "time_constant", "thrust_rate_max"):
        with pytest.raises(BadInput, match=f"^`{name}` must be positive, but is -1 "):
            commanded_thrust(**{name: -1.0})
    with pytest.raises(BadInput, match="`power_per_thrust` must be zero or positive"):
        commanded_thrust(power_per_thrust=-1.0)
    with pytest.raises(BadInput, match="`speed_sensor` must be false with thruster commanded_thrust"):
        hybrid_vehicle(odin(), ONE_TO_FOUR).model(speed_sensor=True)
    with pytest.raises(BadInput, match="`battery` must be left out with a thruster commanded in N"):
        hybrid_vehicle(odin(), ONE_TO_FOUR, battery=battery())
    assert "counts as 0" in commanded_thrust(power_per_thrust=0.0).advice()[0] and not ONE_TO_FOUR.advice()


# ------------------------------------------------------------------------------------------------- what laws make of it

THRUSTERS = {
    "newtons": (ONE_TO_FOUR, np.array([-REVERSE, FORWARD])),
    "volts": (first_order(2.0, 0.1, reverse_share=0.4, supply=15.0), np.array([-12.0, 30.0])),
    "quadratic": (first_order(0.2, 0.1, power=2.0, reverse_share=0.3, linear_gain=2.0, supply=10.0), [-6.0, 20.0]),
}


@pytest.mark.parametrize("name", THRUSTERS)
def test_a_drive_knows_both_limits_and_the_steady_curve(name):
    thruster, limits = THRUSTERS[name]
    drive = thruster.actuator_model(3, False)
    natural, newtons = np.asarray(10.0), np.array([-5.0, 0.5, 11.0])  # 1/s: no faster than by itself

    @jax.jit
    def evaluate(rate):
        still = drive.init()
        commands = drive.command(still, newtons, natural)
        back = drive.quasi_static().force((), commands), drive.target_of(still, commands, natural)
        return jnp.stack(drive.range(still, rate)), commands, back, drive.time_constant()

    within, commands, back, time_constant = jax.tree.map(np.asarray, evaluate(natural))
    np.testing.assert_allclose(within, np.repeat(np.array(limits)[:, None], 3, 1))
    np.testing.assert_allclose(evaluate(2 * natural)[0], np.repeat(np.array(limits)[:, None], 3, 1) / 2)
    assert time_constant == 0.1
    np.testing.assert_allclose(settle(thruster, commands, 3.0).thrust, newtons, rtol=1e-9)
    np.testing.assert_allclose(back, [newtons, newtons], rtol=1e-12)


@pytest.mark.parametrize("name", THRUSTERS)
def test_a_drive_predicts_the_thrust_behind_its_lag(name):
    """Step by step with the thruster itself; made to follow faster than by itself, it does: exp(-rate t)."""
    thruster, _ = THRUSTERS[name]
    drive, rate, dt = thruster.actuator_model(3, False), 30.0, 0.01
    wanted, believed, true = np.array([-1.0, 0.5, 3.0]), drive.init(), thruster.initial_state(3)

    @jax.jit
    def predict(believed):
        volts = drive.command(believed, wanted, rate)
        believed = drive.advance(believed, volts, dt)
        return volts, believed, drive.force(believed, volts)

    for k in range(1, 20):
        volts, believed, force = predict(believed)
        true = settle(thruster, volts, dt, true)
        np.testing.assert_allclose(force, true.thrust, rtol=1e-6)
        # Held over dt the command does in each step what exp(-dt / tau) leaves of it.
        left = (1 - rate * 0.1 * -np.expm1(-dt / 0.1)) ** k
        np.testing.assert_allclose(true.thrust, wanted * (1 - left), rtol=1e-6)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("newtons", "robust"),
        ("volts", "pid"),
        pytest.param("newtons", "pid", marks=pytest.mark.slow),
        pytest.param("volts", "robust", marks=pytest.mark.slow),
    ],
)
def test_a_law_asks_for_no_more_than_each_side_gives(name, law):
    """With the direction of the wanted acceleration kept, its share is that of a linear programme in the true box."""
    thruster, (low, high) = THRUSTERS[name]
    plant = hybrid_vehicle(bluerov2_heavy(), thruster)
    controller = LAWS[law](plant.model(), sampling_time=0.02, direction=1e6)
    own, rng, shares = controller.model, np.random.default_rng(5), []
    # What makes thrusters follow faster than by themselves is taken from the same limits.
    lead = 0.1 * float(controller.actuator_rate) if law == "robust" else 1.0

    @eqx.filter_jit
    def decide(position):
        y = measurement_of_outputs(jnp.zeros(6), jnp.zeros(6))
        r = Target(position, jnp.zeros(6), jnp.zeros(6))
        filter_of = (lambda c: c.filter) if law == "robust" else (lambda c: c.actuation.filter)
        unfiltered = eqx.tree_at(filter_of, controller, None)
        z = unfiltered.init(y, r)
        u, signals = unfiltered.command(z, y, r)
        return (u, signals["attained_share"], unfiltered._plan(z, y, r).forces, own.dynamics.gain(y))

    for _ in range(6):
        position = jnp.asarray(rng.normal(size=6) * [3.0, 3.0, 3.0, 0.3, 0.3, 0.6])
        u, share, forces, effect = decide(position)
        given = thruster.actuator_model(8, False).quasi_static().force((), u)
        assert float(jnp.min(given)) >= low - 1e-9 and float(jnp.max(given)) <= high + 1e-9
        wanted = np.asarray(effect @ forces)
        # max s with effect f = s a, low <= f <= high, 0 <= s <= 1
        found = linprog(
            np.r_[np.zeros(8), -1.0],
            A_eq=np.c_[np.asarray(effect), -wanted],
            b_eq=np.zeros(6),
            bounds=[(low / lead, high / lead)] * 8 + [(0.0, 1.0)],
        )
        np.testing.assert_allclose(share, -found.fun, rtol=2e-3)
        shares.append(float(share))
    assert min(shares) < 0.9, "limits bind"


@pytest.mark.slow
@pytest.mark.parametrize("law", ["robust", "pid"])
def test_a_vehicle_comes_to_its_place_within_both_limits(law):
    """3 m up, which the reverse side of all vertical thrusters limits, as without that limit; no overshoot of 5 cm."""
    plant = hybrid_vehicle(bluerov2_heavy(), commanded_thrust(40.0, 4.0, time_constant=0.05), ledger=False)
    controller = LAWS[law](plant.model(), sampling_time=0.05)
    loop = ClosedLoop(plant, controller, setpoint([3.0, 0.0, 1.0, 0.0, 0.0, 0.0]), none(), perfect())
    how = dict(duration=30.0, dt=0.05, record_every=5, method="euler", substeps=10)
    run = sampled.simulate(loop, **how)
    error, u = np.asarray(run.signals["error"]), np.asarray(run.signals["input"])
    assert int(run.status) == 0
    assert u.min() >= -4.0 and u.max() <= 40.0 and np.asarray(run.signals["saturated"]).any()
    np.testing.assert_allclose(error[-1], 0.0, atol=0.02)
    assert error[:, :3].min() > -0.05


def test_the_thruster_alone_in_a_batch_and_by_xla():
    """Limits on both sides, rate limit and lag: 30 steps under a command that swings beyond them all."""
    thruster = commanded_thrust(40.0, 5.0, time_constant=0.05, thrust_rate_max=60.0)

    def step(size, state, k):
        command = jnp.clip(size * jnp.cos(0.3 * k.astype(float) + jnp.arange(4.0)), *thruster.limits())
        return rk4(lambda t, x: thruster.dynamics(x, command), 0.0, state, 0.02)

    start, thrust = lambda size: thruster.initial_state(4), lambda size, state, k: state.thrust
    program = Loop(lambda size: size, start, step, thrust, jnp.zeros(()), [False])
    _, found = program.run(np.array([60.0, 10.0]), steps=30, every=1)
    by_xla = jax.jit(lambda size: jax.lax.scan(lambda x, k: (step(size, x, k),) * 2, start(size), jnp.arange(30))[1])
    for size, series in zip((60.0, 10.0), np.asarray(found), strict=True):
        np.testing.assert_allclose(series[1:], by_xla(size).thrust, rtol=1e-12, atol=1e-12)
    assert np.asarray(found).max() > 5.0 and np.abs(np.diff(found[0], axis=0)).max() > 0.99 * 60.0 * 0.02


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_batches_and_xla_agree(law):
    """What four thrusters at their limits give together: how redundant ones share is settled by a weight of 1e-6."""
    plant = hybrid_vehicle(bluerov2_heavy(), commanded_thrust(40.0, 0.5, time_constant=0.05, thrust_rate_max=60.0))
    controller = LAWS[law](plant.model(), sampling_time=0.02)
    loop = ClosedLoop(plant, controller, setpoint([3.0, 0.0, 1.0, 0.0, 0.0, 0.0]), none(), perfect())
    how = dict(duration=0.6, dt=0.02, record_every=5)
    found, wanted = simd_batch.simulate(loop, **how), sampled.simulate(loop, **how)
    wrench = lambda samples: np.asarray(samples["input"]) @ np.asarray(plant.thruster_matrix).T
    for pick in (wrench, lambda samples: np.asarray(samples["position"])):
        here, there = pick(found.signals), pick(wanted.signals)
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-9 * np.abs(there).max())
    np.testing.assert_array_equal(found.signals["saturated"], wanted.signals["saturated"])
    assert np.asarray(wanted.signals["saturated"]).any()
