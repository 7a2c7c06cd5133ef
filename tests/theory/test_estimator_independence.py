"""I21: without its s-branch, and fed what was applied, the estimator sees neither controller, limit nor reference.

The s-branch is removed by scaling Q, and with it P and s, down to nothing.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import AbstractController, Model
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.simulation.loop import sampled

pytestmark = pytest.mark.full

COMPOSITE_ONLY = {"weight": ((1e-15, 0.0), (0.0, 1e-15))}
PROBES = {"amplitude": np.array([1.0, 0.5]), "frequency": np.array([3.0, 40.0]), "offset": np.array([0.7, -1.0])}
CASES = {
    "limited": {"limit": 2.0, "goal": 4.0},
    "hard against the stop": {"limit": 1.5, "goal": -5.0},
    "other gains": {"goal": 1.0, "feedback": (9.0, 1.0)},
    "open loop": {"limit": 1e-9, "goal": 4.0},
}


class DeafToLimits(AbstractController):
    """A law told what it asked for instead of what was applied."""

    law: AbstractController
    model: Model

    def init(self, y, r):
        return self.law.init(y, r)

    def command(self, z, y, r):
        return self.law.command(z, y, r)

    def signals(self):
        return self.law.signals()

    def advance(self, z, y, r, u_applied, dt):
        return self.law.advance(z, y, r, self.law.command(z, y, r)[0], dt)


def estimator(loop):
    outcome = sampled.simulate(loop, duration=4.0, record_every=1)
    assert int(outcome.status) == 0
    samples = outcome.signals
    return np.asarray(samples["modelling_error"]), np.asarray(samples["estimate"] - samples["uncertainty"]), samples


@pytest.fixture
def free(rails):
    return estimator(rails(2, goal=2.0, disturbance=sinusoid(**PROBES), **COMPOSITE_ONLY))


@pytest.mark.parametrize("case", CASES)
def test_same_estimator_behind_any_controller(rails, free, case):
    eps, d_til, samples = estimator(rails(2, disturbance=sinusoid(**PROBES), **(COMPOSITE_ONLY | CASES[case])))
    assert np.abs(eps - free[0]).max() <= 1e-9 and np.abs(d_til - free[1]).max() <= 1e-9
    assert np.abs(samples["position"] - free[2]["position"]).max() > 1e-2, "yet the motion is another one"


def test_s_branch_spoils_it(rails):
    """Negative control: at Table 1 the estimate does depend on the reference."""
    one, other = (estimator(rails(2, goal=goal, disturbance=sinusoid(**PROBES))) for goal in (0.0, 2.0))
    assert np.abs(one[1] - other[1]).max() > 1.0


def test_commanded_instead_of_applied_spoils_it(rails, free):
    """Negative control: told the command, the same law winds up against the limit."""
    loop = rails(2, disturbance=sinusoid(**PROBES), **(COMPOSITE_ONLY | CASES["hard against the stop"]))
    deaf = eqx.tree_at(lambda loop: loop.controller, loop, DeafToLimits(loop.controller, loop.controller.model))
    outcome = sampled.simulate(deaf, duration=4.0, record_every=1)
    eps = jnp.abs(outcome.signals["modelling_error"] - free[0])
    assert float(eps.max()) > 1e-3
