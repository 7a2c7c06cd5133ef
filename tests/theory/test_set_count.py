"""I18: number of fuzzy sets and choice of fuzzy input do not matter once gamma rho is matched."""

import jax
import numpy as np
import pytest

from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.simulation.loop import sampled

pytestmark = pytest.mark.full

GATHERING = 0.4217  # rho of three sets, the layout matched by all others
PROBES = {"amplitude": np.array([4.0, 2.0]), "frequency": np.array([2.0, 20.0]), "offset": np.array([-2.0, 1.0])}
LAYOUTS = {
    "one": {"sets": 1, "reach": (1.0,)},
    "five": {"sets": 5, "reach": (2.0,)},
    "seven": {"sets": 7, "reach": (3.0,)},
    "state, nine rules": {"sets": 3, "reach": (4.0, 2.0), "fuzzy_input": "state"},
}


def matched(layout):
    """gamma that keeps gamma rho at that of Table 1 with three sets."""
    rho = float(gaussian_sets(layout["sets"], layout["reach"]).basis_norm_squared())
    return 100.0 * GATHERING / rho


def rms(rails, **choices):
    """Per axis: rms of d_til, rms of e; and the largest |eps|. From rest, so the jump of d at t = 0 counts."""
    loop = rails(2, disturbance=sinusoid(**PROBES), **choices)
    outcome = sampled.simulate(loop, duration=5.0, dt=5e-4, record_every=1)
    samples = jax.tree.map(np.asarray, outcome.signals)
    root = lambda series: np.sqrt((series**2).mean(0))
    peak = np.abs(samples["modelling_error"]).max()
    return root(samples["estimate"] - samples["uncertainty"]), root(samples["error"]), peak


@pytest.fixture(scope="module")
def three():
    return {}


@pytest.mark.parametrize("name", LAYOUTS)
def test_matched_layouts_agree(rails, name, three):
    layout = LAYOUTS[name]
    if not three:
        three["rms"] = rms(rails)
    estimation, tracking, peak = rms(rails, adaptation=matched(layout), **layout)
    assert 20 * peak <= 1.0, "the sets are wider than twenty times the largest modelling error"
    np.testing.assert_allclose(estimation, three["rms"][0], rtol=5e-3)
    np.testing.assert_allclose(tracking, three["rms"][1], rtol=5e-3)


def test_unmatched_layouts_differ(rails, three):
    """Negative control: one set at the same gamma has a rho of its own, and shows it."""
    if not three:
        three["rms"] = rms(rails)
    estimation, _, _ = rms(rails, sets=1)
    assert (np.abs(estimation / three["rms"][0] - 1) > 0.05).all()
