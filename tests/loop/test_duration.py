"""A continuous run lasts as long as it is told, whether or not it ends at a record."""

import jax
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import continuous
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full


@pytest.mark.parametrize(
    ("tolerances", "steps"),
    # As many records of the adaptive run either way, so that it is compiled once.
    [(None, (0.01, 0.1)), ((1e-10, 1e-12), (0.29 / 3, 0.08))],
    ids=["fixed", "adaptive"],
)
def test_the_end_does_not_depend_on_the_records(tolerances, steps):
    plant = double_integrator(1)
    loop = ClosedLoop(
        plant, rcaf(plant.model(), preset="paper", sets=3), setpoint(np.ones(1)), sinusoid(1.0, 2.0), perfect()
    )
    often, seldom = (
        continuous.simulate(loop, duration=0.29, record_step=step, dt=1e-3, tolerances=tolerances) for step in steps
    )
    assert float(often.ended) == float(seldom.ended) == pytest.approx(0.29, abs=1e-15)
    np.testing.assert_allclose(seldom.time, np.arange(len(seldom.time)) * steps[1], atol=1e-15)
    assert 0.29 - steps[1] < seldom.time[-1] < 0.29
    np.testing.assert_allclose(often.time[-1], 0.29, atol=1e-15)
    for one, other in zip(*(jax.tree.leaves(run.final) for run in (often, seldom)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(often.signals["position"][-1], seldom.final[0].position, rtol=1e-7)
    assert abs(float(often.signals["position"][-1, 0] - seldom.signals["position"][-1, 0])) > 1e-3  # it moves meanwhile
