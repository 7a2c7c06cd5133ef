"""Preset `robust` where the paper's law fails: on its own motor, on other plants, and over the top."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import rotation_from_euler, wrap_angle

from undertow.control.controllers import rcaf
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.contracts import AbstractReference, Target
from undertow.physics.disturbances import none, sinusoid, table, u1
from undertow.physics.plants import double_integrator, hybrid_vehicle, magnetic_levitation
from undertow.physics.thrusters import paper_table3, t200
from undertow.physics.vehicles import bluerov2_heavy, odin
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

TARGET = [2.0, 3.0, 4.0, math.pi / 3, math.pi / 4, 2 * math.pi / 5]


def tracking(loop):
    """Rms of the error over the second half of 20 s, all axes together; and how the run ended."""
    run = sampled.simulate(loop, duration=20.0, dt=1e-3, record_every=10)
    late = np.asarray(run.signals["error"])[1000:]
    return float(np.sqrt((late**2).mean())), int(run.status), run


@pytest.mark.slow
@pytest.mark.parametrize(("speed_sensor", "bar"), [pytest.param(True, 5e-4, marks=pytest.mark.slow), (False, 1.5e-3)])
def test_whole_motor_at_24_volts(speed_sensor, bar):
    """Suite U1 scaled by 0.3, which is attainable; Table 1 limit-cycles there."""
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical", supply=24.0), ledger=False)
    law = rcaf(plant.model(speed_sensor=speed_sensor), preset="robust")
    rms, status, run = tracking(ClosedLoop(plant, law, setpoint(TARGET), u1(scale=0.3), perfect()))
    print(f"speed_sensor {speed_sensor}: {rms:.3g} m, rad")
    assert status == 0 and rms < bar
    assert float(jnp.abs(run.signals["input"]).max()) <= 24.0


@pytest.mark.slow
def test_table_1_does_not_hold_there():
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical", supply=24.0), ledger=False)
    rms, status, run = tracking(
        ClosedLoop(plant, rcaf(plant.model(), preset="paper"), setpoint(TARGET), u1(scale=0.3), perfect())
    )
    at_limit = float(np.asarray(run.signals["saturated"])[1000:].mean())
    assert status != 0 or (rms > 5e-3 and at_limit > 0.5), (rms, status, at_limit)


def test_the_estimator_depends_on_neither_controller_nor_limits():
    """I21, with the sampled law: modelling error and d_til to 1e-9 for other gains, references and limits."""

    def run(tracking, position, limit):
        plant = double_integrator(2, limit=limit)
        law = rcaf(plant.model(), preset="robust", bandwidth=40.0, tracking=tracking, sampling_time=1e-3)
        loop = ClosedLoop(plant, law, setpoint(position), sinusoid([1.0, 2.0], [3.0, 7.0]), perfect())
        samples = sampled.simulate(loop, duration=3.0, dt=1e-3, record_every=1).signals
        return np.asarray(samples["modelling_error"]), np.asarray(samples["estimate"] - samples["uncertainty"])

    first, second = run(2.0, [0.0, 0.0], math.inf), run(8.0, [3.0, -1.0], 4.0)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize(("frequency", "recovers"), [(None, True), (0.0, False)])
def test_carried_away_it_comes_back_without_swinging(frequency, recovers):
    """1.5 s of twice what the actuator can do, 140 rad/s of feedback; without a target that gives way it swings."""
    plant = double_integrator(1, limit=2.0)
    law = rcaf(plant.model(), preset="robust", reference_frequency=frequency)
    push = table([[0.0, 0.0], [2.0, 0.0], [2.01, 4.0], [3.5, 4.0], [3.51, 0.0], [20.0, 0.0]])
    loop = ClosedLoop(plant, law, setpoint([0.0]), push, perfect())
    run = sampled.simulate(loop, duration=20.0, dt=1e-3, record_every=10)
    error = np.asarray(run.signals["error"])[:, 0]
    assert np.abs(error).max() > 4.0  # m
    overshoot = -error[np.abs(error).argmax() :].min() if error[np.abs(error).argmax()] > 0 else error.max()
    assert (overshoot < 0.02) == recovers, overshoot
    assert (np.abs(error[-200:]).max() < 1e-4) == recovers


class Somersault(AbstractReference):
    """One turn about the pitch axis in 10 s, on the spot; as Euler angles it jumps twice, as a rotation never."""

    def at(self, t) -> Target:
        return jax.lax.cond(jnp.cos(_angle(t)[0]) >= 0, self._upright, self._upside_down, t)

    def _upright(self, t) -> Target:
        angle, rate, bend = _angle(t)
        return Target(*(jnp.zeros(6).at[4].set(value) for value in (wrap_angle(angle), rate, bend)))

    def _upside_down(self, t) -> Target:
        angle, rate, bend = _angle(t)
        return Target(
            jnp.zeros(6).at[3:].set(jnp.stack([jnp.pi, jnp.pi - angle, jnp.pi])),
            jnp.zeros(6).at[4].set(-rate),
            jnp.zeros(6).at[4].set(-bend),
        )


def _angle(t):
    """A turn from rest to rest: angle, rate and its rate."""
    turn = lambda t: jnp.pi * (1 - jnp.cos(jnp.pi * t / 10.0))
    return turn(t), jax.jacfwd(turn)(t), jax.jacfwd(jax.jacfwd(turn))(t)


@pytest.mark.slow
def test_a_somersault_is_uneventful():
    """Through pitch 90 degrees twice, where a run in Euler angles ends."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0), ledger=False)
    law = rcaf(plant.model(), preset="robust", sampling_time=1e-2, reference_frequency=0.0)
    turned = ClosedLoop(plant, law, Somersault(), none(), perfect())
    run = sampled.simulate(turned, duration=10.0, dt=1e-2, record_every=1, method="euler", substeps=4)
    assert int(run.status) == 0
    at = jax.vmap(lambda t: rotation_from_euler(Somersault().at(t).position[3:]))(run.time)
    rotation = jax.vmap(lambda p: rotation_from_euler(p[3:]))(run.signals["position"])
    apart = jnp.arccos(jnp.clip((jnp.einsum("tij,tij->t", at, rotation) - 1) / 2, -1, 1))
    assert float(apart.max()) < 0.2
    assert float(jnp.abs(run.signals["position"][:, :3]).max()) < 0.2


@pytest.mark.parametrize("gap", [0.006, 0.005])
def test_a_ball_near_the_magnet(gap):
    """Where the coil lags by 8.3 and 10.4 ms Table 1 lets it fall (C14)."""
    plant = magnetic_levitation()
    law = rcaf(plant.model(), preset="robust")
    loop = ClosedLoop(plant, law, sine(1e-3, 1.0, gap), none(), perfect())
    samples = sampled.simulate(loop, duration=10.0, dt=1e-3, record_every=10, position=[gap]).signals
    assert float(jnp.abs(samples["error"][500:]).max()) < 5e-6
