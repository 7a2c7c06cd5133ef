"""Preset `robust`: fuzzy weights that noise drives apart come together again, so that they do not grow for as long as a run lasts."""

import axis_forms
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis import drift
from undertow.control.controllers.presets.robust import robust
from undertow.control.controllers.robust.estimator import Estimator, EstimatorState
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation import perfect, white_noise
from undertow.control.references import setpoint
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

DT, NOISE, AXES = 1e-3, 0.003, 20  # s, m/s; every axis has noise of its own


def drift_gain(leakage):
    """c of section 3.8, 1/s, mean over the axes, every second of 100 s; and the law."""
    plant = double_integrator(AXES)
    law = robust(plant.model(), bandwidth=60.0, reach=(0.2,), leakage=leakage, reference_frequency=0.0)
    loop = ClosedLoop(plant, law, setpoint(np.zeros(AXES)), none(), white_noise(0.0, NOISE))
    run = sampled.simulate(loop, duration=100.0, dt=DT, record_every=1000)
    assert int(run.status) == 0
    return drift.gain_of(law, np.asarray(run.signals["weights"])).mean(axis=1), law


@pytest.mark.slow
def test_drift_ends_where_leakage_takes_as_much_as_noise_brings():
    """c_dot = rate - kappa c, so c comes to rate / kappa and stays: after a week it is what it is after minutes."""
    gain, law = drift_gain(0.1)
    settled = gain[50:].mean()
    rate = axis_forms.drift_rate(law, DT, axis_forms.noise_square(law, DT, NOISE, settled))
    assert settled == pytest.approx(rate / 0.1, rel=0.1)
    assert gain[75:].mean() == pytest.approx(gain[50:75].mean(), rel=0.05)
    without, _ = drift_gain(0.0)
    assert without[-1] > 5 * settled and without[-1] > 1.5 * without[50], "negative control: it grows on and on"


def test_a_constant_load_is_estimated_without_bias():
    plant = double_integrator(1)
    law = robust(plant.model(), bandwidth=30.0, reach=(0.5,), leakage=0.5, reference_frequency=0.0)
    loop = ClosedLoop(plant, law, setpoint([0.0]), sinusoid(0.0, 1.0, offset=3.0), perfect())
    last = jax.tree.map(lambda x: x[-1], sampled.simulate(loop, duration=60.0, dt=DT, record_every=1000).signals)
    np.testing.assert_allclose(last["estimate"], 3.0, rtol=1e-9)


def test_leakage_alone_never_takes_weights_away_from_those_of_a_constant_load():
    """|theta - d 1|^2 does not grow, whatever theta and d are: the leakage can only help the Lyapunov function."""
    rng = np.random.default_rng(5)
    estimator = Estimator(gaussian_sets(5), bandwidth=20.0, bound=jnp.inf, leakage=3.0)

    @jax.jit
    def leaked(rate, weights):
        still = estimator.estimate(EstimatorState(rate, weights), rate)  # no modelling error
        after = estimator.advance(EstimatorState(rate, weights), still, jnp.zeros(1), jnp.zeros(1), 0.05)
        return after.weights, still.basis

    for _ in range(200):
        weights, d, rate = rng.normal(size=(1, 5)), rng.normal(), jnp.asarray(rng.normal(size=1))
        after, basis = map(np.asarray, leaked(rate, weights))
        assert ((after - d) ** 2).sum() < ((weights - d) ** 2).sum()
        np.testing.assert_allclose(after.mean(), weights.mean(), atol=1e-12)
        shown = [(one * basis).sum() for one in (after, weights)]
        np.testing.assert_allclose(*shown, atol=1e-12)  # the estimate does not see it
