"""Section 3.6, the whole table: largest sampling times by closed form, and the nonlinear loop on both sides of each.

The law's own state may be stepped explicitly, semi-implicitly (weights first, then the identification model with the
new estimate) or exactly; the input may reach the plant one step late, and the law is told when it does.
"""

import axis_forms
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from undertow.analysis import small_signal
from undertow.control.controllers.rcaf import rcaf
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractController, Model
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

RHO = float(gaussian_sets(3).basis_norm_squared())
LAYOUTS = {"three sets": {"sets": 3}, "one set": {"sets": 1}, "rho = 1/3": {"sets": 3, "adaptation": 100 / (3 * RHO)}}
# Rule, delay, RAFC -> limits in ms as printed, one per layout.
TABLE = {
    ("euler", False, False): (7.09, 3.00, 8.94),
    ("semi-implicit", False, False): (8.50, 6.53, 8.94),
    ("exact", False, False): (9.71, 4.85, 11.45),
    ("euler", False, True): (13.5, 13.5, 13.5),
    ("euler", True, False): (7.21, 2.95, 9.39),
    ("exact", True, False): (5.91, 3.97, 6.53),
}
# Each of the others is a program of its own, which takes seconds to compile.
QUICK = {
    ("euler", False, False, "three sets"),
    ("euler", False, True, "three sets"),
    ("euler", True, False, "three sets"),
}
CASES = [(*case, layout) for case in TABLE for layout in LAYOUTS]
CASES = [case if case in QUICK else pytest.param(*case, marks=pytest.mark.slow) for case in CASES]


def law_of(rule, rafc, layout):
    choices = (
        LAYOUTS[layout]
        | ({"composite": 0.0} if rafc else {})
        | ({"method": "rk4", "substeps": 3} if rule == "exact" else {})
    )
    return rcaf(double_integrator().model(), preset="paper", **choices)


def tick_matrix(g, dt, rule, delayed):
    """One step of (e, e_dot, eps, d_hat, input on its way)."""
    unit = np.eye(5)
    asked = np.array([g.stiffness, g.damping, 0.0, -1.0, 0.0])
    applied = unit[4] if delayed else asked
    filtered = np.array([g.p12, g.p22, 0.0, 0.0, 0.0])
    rates, learning = np.array([-g.pole, 1.0, 0.0, 1.0]), np.array([-g.b2, 0.0, -g.adaptation, 0.0])
    flow = np.stack([rates, learning, np.zeros(4), np.zeros(4)])  # of x_hat_dot - x_dot held, d_hat; driven by s, u
    across = expm(dt * flow) if rule == "exact" else np.eye(4) + dt * flow
    if rule == "semi-implicit":
        across[0] += dt * (across[1] - np.eye(4)[1])
    learned = across[:2] @ np.stack([unit[2], unit[3], filtered, applied])
    moved = unit[0] + dt * unit[1] - dt**2 / 2 * applied
    return np.stack([moved, unit[1] - dt * applied, learned[0] - dt * applied, learned[1], asked])


def limit(law, rule, delayed):
    """Sampling time, s, at which the spectral radius reaches one."""
    g = small_signal.gains(law)
    unstable = lambda dt: bool(np.abs(np.linalg.eigvals(tick_matrix(g, dt, rule, delayed))).max() > 1)
    return small_signal.first_crossing(unstable, np.geomspace(1e-3, 3e-2, 61))


@pytest.mark.parametrize("case", TABLE)
def test_closed_forms(case):
    """The printed values are the next ones on a coarse grid, and so up to 2 % too long; ours are the crossings."""
    rule, delayed, rafc = case
    for printed, layout in zip(TABLE[case], LAYOUTS, strict=True):
        found = 1e3 * limit(law_of(rule, rafc, layout), rule, delayed)
        print(f"{rule}, delayed {delayed}, rafc {rafc}, {layout}: {found:.3f} ms, printed {printed}")
        assert 0.98 * printed < found < 1.002 * printed


def test_without_delay_it_is_the_matrix_of_the_package(table1):
    for rule in axis_forms.RULES:
        ours = tick_matrix(small_signal.gains(table1()), 2e-3, rule, False)
        np.testing.assert_allclose(ours[:4, :4], axis_forms.sampled_matrix(table1(), 2e-3, rule), atol=1e-12)


class Stepped(AbstractController):
    """The law with its input one step late, its weights stepped before its identification model, or as it is."""

    model: Model
    law: AbstractController
    semi_implicit: bool
    delayed: bool

    def init(self, y, r):
        return self.law.init(y, r), jnp.zeros_like(y.position)

    def command(self, z, y, r):
        asked, signals = self.law.command(z[0], y, r)
        return z[1] if self.delayed else asked, signals

    def signals(self):
        return self.law.signals()

    def advance(self, z, y, r, u_applied, dt):
        asked, _ = self.law.command(z[0], y, r)
        if not self.semi_implicit:
            return self.law.advance(z[0], y, r, u_applied, dt), asked
        learned = z[0]._replace(weights=self.law.advance(z[0], y, r, u_applied, dt).weights)
        moved = self.law.advance(learned, y, r, u_applied, dt)
        return moved._replace(weights=learned.weights), asked


@pytest.mark.parametrize(("rule", "delayed", "rafc", "layout"), CASES)
def test_nonlinear_loop_agrees(rule, delayed, rafc, layout):
    """From a nanometre off, 3 % below and above the crossing: eps dies out, or leaves where it was far behind."""
    law = law_of(rule, rafc, layout)
    plant = double_integrator()
    stepped = Stepped(law.model, law, rule == "semi-implicit", delayed)
    loop = ClosedLoop(plant, stepped, setpoint([1e-9]), none(), perfect())
    for factor in (0.97, 1.03):
        dt = factor * limit(law, rule, delayed)
        samples = sampled.simulate(loop, duration=1500 * dt, dt=dt, record_every=1).signals
        eps = np.abs(np.asarray(samples["modelling_error"]))[:, 0]
        first, later = eps[:50].max(), eps[-200:].max()
        assert later < 1e-2 * first if factor < 1 else later > 100 * first, (factor, first, later)
