"""I26, section 3.10: a step of 2 m under d = 1 m/s^2 with limited |u|, and who winds up.

The identification model may be told what was applied (as the package does) or what was commanded (as the paper
leaves open); RAFC learns from s alone.
"""

import numpy as np
import pytest

from undertow.analysis import small_signal
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractController, Model
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

LIMITS = (np.inf, 5.0, 3.0, 1.5)  # m/s^2
SURVIVES = {
    "applied": (True, True, True, True),
    "commanded": (True, True, False, False),
    "rafc": (True, False, False, False),
    "robust": (True, True, True, True),
}


class FedCommanded(AbstractController):
    """A law that never hears of limits."""

    model: Model
    law: AbstractController

    def init(self, y, r):
        return self.law.init(y, r)

    def command(self, z, y, r):
        return self.law.command(z, y, r)

    def signals(self):
        return self.law.signals()

    def advance(self, z, y, r, u_applied, dt):
        commanded, _ = self.law.command(z, y, r)
        return self.law.advance(z, y, r, commanded, dt)


def step(name, limit, load=1.0):
    """Error, estimate and s of the step at every step, on one axis, and the law."""
    plant = double_integrator(1, limit)
    choices = {"rafc": {"sets": 3, "composite": 0.0}, "robust": {"preset": "robust"}}.get(name, {"sets": 3})
    law = rcaf(plant.model(), **({"preset": "paper"} | choices))
    fed = FedCommanded(law.model, law) if name == "commanded" else law
    loop = ClosedLoop(plant, fed, setpoint([2.0]), sinusoid(0.0, 1.0, offset=load), perfect())
    samples = sampled.simulate(loop, duration=40.0, dt=1e-3, record_every=1).signals
    error, velocity = np.asarray(samples["error"])[:, 0], np.asarray(samples["velocity"])[:, 0]
    return error, np.asarray(samples["estimate"])[:, 0], 5 * (error - velocity), law


@pytest.mark.parametrize("name", SURVIVES)
def test_table_of_section_3_10(name):
    for limit, survives in zip(LIMITS, SURVIVES[name], strict=True):
        error, estimate, _, _ = step(name, limit)
        peak, late = np.abs(estimate).max(), np.abs(error[-10_000:]).max()
        print(f"{name}, limit {limit}: peak d_hat {peak:.4g}, error in the last ten seconds {late:.3g} m")
        if survives:
            assert late < 1e-6
        else:
            assert late > 50.0 and peak > 1e5
        if (name, limit) == ("applied", 1.5):
            assert -error.min() == pytest.approx(0.77, rel=0.01)
        if (name, limit) == ("commanded", 5.0):
            assert peak == pytest.approx(348.0, rel=0.01)
        if (name, limit) == ("rafc", np.inf):
            assert peak == pytest.approx(19.0, rel=0.03)
        if name == "robust":
            assert peak < 1.01 and -error.min() < 1e-3, "neither wound up nor too far"


def test_estimate_is_bounded_whatever_the_limit():
    """|d_hat| <= (1 + overshoot) |d| + (L1 gain from s) max |s|: with the applied input only s and d reach it."""
    for limit in LIMITS:
        for load in (0.0, 1.0, -4.0):
            _, estimate, s, law = step("applied", limit, load)
            bound = bound_of(law, load, np.abs(s).max())
            assert np.abs(estimate).max() <= bound
            if load == 0.0 and limit == np.inf:
                assert np.abs(estimate).max() > 0.6 * bound, "the bound is being tried"


def test_static_bias_is_no_bound():
    """Negative control: |d| + 0.31 max |s| and 10 % more is exceeded without any limit: the estimator overshoots."""
    _, estimate, s, _ = step("applied", np.inf, load=0.0)
    assert np.abs(estimate).max() > 1.1 * 0.31 * np.abs(s).max()


def bound_of(law, load, largest):
    """From d_hat = (b2 d - gamma rho (p + a1) s) / (p^2 + a1 p + b2)."""
    g = small_signal.gains(law)
    damping = small_signal.observer_damping(law)
    overshoot = np.exp(-np.pi * damping / np.sqrt(1 - damping**2))
    times = np.linspace(0.0, 60 / g.pole, 200_001)
    decay, swing = g.pole / 2, np.sqrt(g.b2 - g.pole**2 / 4)
    impulse = np.exp(-decay * times) * (np.cos(swing * times) + decay / swing * np.sin(swing * times))
    return (1 + overshoot) * abs(load) + g.adaptation * np.trapezoid(np.abs(impulse), times) * largest
