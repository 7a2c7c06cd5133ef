"""I17: under sinusoidal d the nonlinear law is the transfer function of section 3.4, until its weights drift.

One run; every axis has a frequency of its own. Amplitudes come from a least-squares fit of the record: sine, cosine,
constant and the slow pole exp(-t).
"""

import axis_forms
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis import small_signal
from undertow.control.controllers.rcaf import rcaf
from undertow.control.estimation.fuzzy_system import memberships
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import continuous
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

FREQUENCIES = np.array([0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 150.0, 200.0])
FAST = np.flatnonzero(FREQUENCIES >= 100)


@pytest.fixture(scope="module")
def record():
    plant = double_integrator(len(FREQUENCIES))
    law = rcaf(plant.model(), preset="paper", sets=3)
    goal = setpoint(np.zeros(len(FREQUENCIES)))
    loop = ClosedLoop(plant, law, goal, sinusoid(1.0, FREQUENCIES), perfect())
    outcome = continuous.simulate(loop, duration=16.0, tolerances=(1e-7, 1e-9))
    assert int(outcome.status) == 0
    return law, np.asarray(outcome.time), jax.tree.map(np.asarray, outcome.signals)


def amplitudes(time, series, starts, ends):
    """Amplitude of each column at its own frequency, over its own window."""
    found = []
    for column, frequency, start, end in zip(series.T, FREQUENCIES, starts, ends, strict=True):
        window = (time >= start) & (time <= end)
        t = time[window]
        basis = np.stack([np.sin(frequency * t), np.cos(frequency * t), np.ones_like(t), np.exp(-t)], 1)
        sine, cosine, *_ = np.linalg.lstsq(basis, column[window], rcond=None)[0]
        found.append(np.hypot(sine, cosine))
    return np.array(found)


def early():
    """From half a second, when the observer's own transient is over, through one period or two seconds."""
    return np.full(len(FREQUENCIES), 0.5), 0.5 + np.maximum(2.0, 2 * np.pi / FREQUENCIES)


def test_estimation_error_within_one_percent(record):
    law, time, samples = record
    measured = amplitudes(time, samples["estimate"] - samples["uncertainty"], *early())
    np.testing.assert_allclose(measured, np.abs(small_signal.estimation_response(law, FREQUENCIES)), rtol=0.01)


def test_tracking_error_within_one_percent(record):
    law, time, samples = record
    measured = amplitudes(time, samples["error"], *early())
    np.testing.assert_allclose(measured, np.abs(axis_forms.tracking_response(law, FREQUENCIES)), rtol=0.01)


def test_measured_uncertainty_is_the_disturbance(record):
    _, time, samples = record
    np.testing.assert_allclose(samples["uncertainty"], np.sin(FREQUENCIES * time[:, None]), atol=1e-12)


def test_departure_after_a_while_is_the_gain_that_drift_adds(record):
    """Negative control and section 3.8: by the end the fast axes are off by more; d_hat = z - c eps explains it."""
    law, time, samples = record
    starts, ends = np.full(len(FREQUENCIES), 14.0), np.full(len(FREQUENCIES), 16.0)
    measured = amplitudes(time, samples["estimate"] - samples["uncertainty"], starts, ends)
    plain = np.abs(small_signal.estimation_response(law, FREQUENCIES))
    assert (np.abs(measured / plain - 1)[FAST] > 0.01).all()
    sets = law.fuzzy
    slope = np.asarray(jax.jacfwd(lambda x: memberships(x[None], sets.centres[0], sets.widths[0])[0])(jnp.zeros(())))
    added = -samples["weights"][1500] @ slope  # c, 1/s
    assert (added[FAST] > 1).all() and (added > -1e-9).all()
    for axis in FAST:
        g = small_signal.gains(law)
        p = 1j * FREQUENCIES[axis]
        drifted = p * (p + g.pole) / (p**2 + (g.pole + added[axis]) * p + g.b2)
        observer = p * (p + g.pole) / (p**2 + g.pole * p + g.b2)
        assert measured[axis] == pytest.approx(plain[axis] * abs(drifted / observer), rel=0.01)
