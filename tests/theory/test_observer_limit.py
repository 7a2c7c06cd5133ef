"""Limit of stability with an observer of velocity: by the poles of the loop, and by runs on both sides of it."""

import numpy as np
import pytest

from undertow.analysis.observer_limit import LinearLaw, loop_poles, papers_law, slowest_observer
from undertow.analysis.small_signal import poles
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.pose_only import pose_only
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

ROBUST = LinearLaw(pole=40.0, frequency=20.0, feedback=(25.0, 10.0))


@pytest.mark.parametrize("order", [2, 3])
def test_fast_observer_leaves_the_poles_of_law_and_observer(order):
    """As w grows, poles are those of measured velocity (tracking twice at 5, estimator twice at 20) and -w."""
    found = loop_poles(ROBUST, 1e5, order)
    slow = found[np.abs(found) < 1e3]
    np.testing.assert_allclose(np.sort(np.abs(slow)), [5.0, 5.0, 20.0, 20.0], rtol=0.05)
    assert np.prod(-found[np.abs(found) > 1e3]) == pytest.approx(1e5**order, rel=1e-2)


def test_papers_law_with_a_fast_observer_is_that_with_measured_velocity():
    """The four poles of the table of section 3.3."""
    law = rcaf(double_integrator(1).model(), preset="paper", composite=50.0)
    fast = loop_poles(papers_law(law), 1e6)
    slow = fast[np.argsort(-fast.real)][:4]
    np.testing.assert_allclose(slow, poles(law), rtol=2e-3)


@pytest.mark.parametrize("order", [2, 3])
def test_limit_scales_with_the_law(order):
    """A law whose rates are all doubled needs an observer that is twice as fast."""
    double = LinearLaw(80.0, 40.0, (100.0, 20.0))
    assert slowest_observer(double, order) == pytest.approx(2 * slowest_observer(ROBUST, order), rel=1e-6)
    assert loop_poles(ROBUST, 1.001 * slowest_observer(ROBUST, order), order).real.max() < 0
    assert loop_poles(ROBUST, 0.999 * slowest_observer(ROBUST, order), order).real.max() > 0


@pytest.mark.parametrize("order", [2, 3])
def test_runs_on_both_sides_of_the_limit(order):
    """The sampled law on a double integrator decays with a faster observer and grows with a slower one."""
    plant = double_integrator(1)
    limit, peaks = slowest_observer(ROBUST, order), []
    for factor in (0.9, 1.1):
        law = rcaf(
            plant.model(), preset="robust", sampling_time=1e-3, bandwidth=20.0, feedback=(25.0, 10.0), leakage=0.0,
            reference_frequency=0.0, weights_bound=1e6,
        )  # fmt: skip
        filter_ = pose_only(bandwidth=factor * limit, order=order, sampling_time=1e-3)
        loop = ClosedLoop(plant, law, setpoint([0.0]), none(), filter_)
        run = simd_batch.simulate(loop, duration=12.0, dt=1e-3, position=np.array([1e-6]), record_every=10)
        size = np.abs(run.signals["error"][:, 0])
        peaks.append(size[-200:].max() / size[200:400].max())
    assert peaks[0] > 3 and peaks[1] < 1 / 3
