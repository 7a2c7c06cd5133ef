"""Preset `robust` on the paper's own motor, where Table 1 fails."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.controllers import rcaf
from undertow.disturbances import sinusoid, u1
from undertow.loop import sampled
from undertow.loop.closed_loop import ClosedLoop
from undertow.plants import double_integrator, hybrid_vehicle
from undertow.references import setpoint
from undertow.sensors import perfect
from undertow.thrusters import paper_table3
from undertow.vehicles import odin

TARGET = [2.0, 3.0, 4.0, math.pi / 3, math.pi / 4, 2 * math.pi / 5]


def tracking(loop):
    """Rms of the error over the second half of 20 s, all axes together; and how the run ended."""
    run = sampled.simulate(loop, duration=20.0, dt=1e-3, record_every=10)
    late = np.asarray(run.samples.error)[1000:]
    return float(np.sqrt((late**2).mean())), int(run.status), run


@pytest.mark.parametrize(("speed_sensor", "bar"), [(True, 5e-4), (False, 1.5e-3)])
def test_whole_motor_at_24_volts(speed_sensor, bar):
    """Suite U1 scaled by 0.3, which is attainable; Table 1 limit-cycles there."""
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical", supply=24.0), ledger=False)
    law = rcaf(plant.model(speed_sensor=speed_sensor), preset="robust")
    rms, status, run = tracking(ClosedLoop(plant, law, setpoint(TARGET), u1(scale=0.3), perfect()))
    print(f"speed_sensor {speed_sensor}: {rms:.3g} m, rad")
    assert status == 0 and rms < bar
    assert float(jnp.abs(run.samples.voltage).max()) <= 24.0


def test_table_1_does_not_hold_there():
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical", supply=24.0), ledger=False)
    rms, status, run = tracking(ClosedLoop(plant, rcaf(plant.model()), setpoint(TARGET), u1(scale=0.3), perfect()))
    at_limit = float(np.asarray(run.samples.saturated)[1000:].mean())
    assert status != 0 or (rms > 5e-3 and at_limit > 0.5), (rms, status, at_limit)


def test_the_estimator_depends_on_neither_controller_nor_limits():
    """I21, with the sampled law: modelling error and d_til to 1e-9 for other gains, references and limits."""

    def run(tracking, position, limit):
        plant = double_integrator(2, limit=limit)
        law = rcaf(plant.model(), preset="robust", bandwidth=40.0, tracking=tracking, sampling_time=1e-3)
        loop = ClosedLoop(plant, law, setpoint(position), sinusoid([1.0, 2.0], [3.0, 7.0]), perfect())
        samples = sampled.simulate(loop, duration=3.0, dt=1e-3, record_every=1).samples
        return np.asarray(samples.modelling_error), np.asarray(samples.estimate - samples.uncertainty)

    first, second = run(2.0, [0.0, 0.0], math.inf), run(8.0, [3.0, -1.0], 4.0)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
