"""I22, second half: with tanh for sign, rms |E| ends below the residue of the two boundary layers.

From Vf_dot <= -1/2 E^T Q E + 0.2785 (phi w_bar + phi_c gamma_eps omega_bar), which needs |omega| <= w_bar and
|omega| <= omega_bar, omega the part of d that no constant weight explains.
"""

import jax
import numpy as np
import pytest

from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.simulation.loop import sampled

pytestmark = pytest.mark.full

AXES = 24


def draws():
    """Gains per axis over one to three decades, and disturbances that just meet the hypothesis."""
    random = np.random.default_rng(22)
    spread = lambda low, high: np.exp(random.uniform(np.log(low), np.log(high), AXES))
    gains = {
        "robust_gain": spread(0.1, 3.0),
        "compensation_gain": spread(0.1, 1.0),
        "layer": spread(0.01, 0.5),
        "adaptation": spread(0.1, 100.0),
        "composite": spread(0.1, 50.0),
        "feedback": np.stack([spread(0.5, 4.0), spread(1.0, 4.0)], 1),
        "weight": np.eye(2) * spread(1.0, 20.0)[:, None, None],
    }
    omega = np.minimum(gains["robust_gain"], gains["compensation_gain"])
    return gains, {"amplitude": omega, "frequency": spread(0.3, 5.0), "offset": random.uniform(-3, 3, AXES)}


@pytest.mark.slow
def test_ultimate_error_is_within_the_bound(rails):
    gains, signals = draws()
    loop = rails(AXES, goal=0.5, disturbance=sinusoid(**signals), compensation_layer=0.5, **gains)
    outcome = sampled.simulate(loop, duration=240.0, dt=4e-3, record_every=5)
    assert int(outcome.status) == 0
    samples = jax.tree.map(np.asarray, outcome.signals)
    late = np.asarray(outcome.time) > 120.0
    measured = np.sqrt((samples["error"] ** 2 + samples["velocity"] ** 2)[late].mean(0))
    residue = 0.2785 * (gains["layer"] * gains["robust_gain"] + 0.5 * gains["composite"] * gains["compensation_gain"])
    bound = np.sqrt(2 * residue / gains["weight"][:, 0, 0])
    assert (measured <= bound).all(), measured / bound
    assert (measured / bound).max() > 0.05, "no axis comes near: the bound is not being tried"
