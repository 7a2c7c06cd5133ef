"""I23: the largest sampling time, by spectral radius and by the nonlinear loop; theory.md section 3.6."""

import axis_forms
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from undertow.analysis import small_signal
from undertow.core.numerics.integrators import rk4
from undertow.simulation.loop import sampled

pytestmark = pytest.mark.full

LIMITS = {"euler": 7.09e-3, "exact": 9.71e-3}
DISCRETISED = {"euler": {}, "exact": {"method": "rk4", "substeps": 3}}
RULES = list(LIMITS)


def radius(law, dt, rule):
    return np.abs(np.linalg.eigvals(axis_forms.sampled_matrix(law, dt, rule))).max()


@pytest.mark.parametrize("rule", RULES)
def test_spectral_radius_on_both_sides(table1, rule):
    law = table1(**DISCRETISED[rule])
    assert radius(law, 0.95 * LIMITS[rule], rule) < 1 < radius(law, 1.05 * LIMITS[rule], rule)
    assert axis_forms.largest_sampling_time(law, rule) == pytest.approx(LIMITS[rule], rel=0.05)


@pytest.mark.parametrize("rule", RULES)
def test_nonlinear_loop_agrees(rails, rule):
    """From a micrometre off: bounded below the limit; above it, ten times its first envelope is soon left behind.

    (It then recovers: the drift of section 3.8 adds damping, which the linear law does not have.)
    """
    loop = rails(1, goal=1e-6, **DISCRETISED[rule])
    for factor, stable in ((0.95, True), (1.05, False)):
        dt = factor * LIMITS[rule]
        outcome = sampled.simulate(loop, duration=1000 * dt, dt=dt, record_every=1)
        eps = np.abs(np.asarray(outcome.signals["modelling_error"]))[:, 0]
        first, later = eps[:100].max(), eps[100:].max()
        assert later < first if stable else later > 10 * first, (rule, factor, first, later)


@pytest.mark.parametrize("rule", RULES)
def test_jacobian_is_that_of_the_code(rails, rule):
    """Eigenvalues of one step by central differences: the predicted four, and ones for what is marginal."""
    loop = rails(1, **DISCRETISED[rule])
    drawn = loop.realize(jax.random.PRNGKey(0))
    zero = jnp.zeros(())
    flat, restore = ravel_pytree(drawn.start())

    def advance(flat, step):
        x, z = restore(flat)
        seen = drawn.decide(zero, x, z)
        moved = rk4(lambda t, x: loop.plant.dynamics(t, x, seen.applied, drawn.load(t, x)), zero, x, step)
        after = moved, loop.controller.advance(z, seen.y, seen.r, seen.applied, step)
        return ravel_pytree(after)[0]

    advance = jax.jit(advance)
    nudges = 1e-6 * np.eye(flat.size)
    for dt in (1e-3, 3e-3):
        step = jnp.asarray(dt)
        columns = [(advance(flat + nudge, step) - advance(flat - nudge, step)) / 2e-6 for nudge in nudges]
        found = np.linalg.eigvals(np.stack(columns, 1))
        predicted = np.linalg.eigvals(axis_forms.sampled_matrix(loop.controller, dt, rule))
        marginal = np.ones(len(found) - 4)  # x_hat, and weights that cancel in d_hat
        for value in np.concatenate([predicted, marginal]):
            assert np.abs(found - value).min() < 2e-5, (dt, value, found)


def test_closed_forms_of_the_parts(table1):
    """Observer alone: a1 / b2. Boundary layer: (k2 + w_bar p22 / phi) Ts < 2. Identification pole: a1 Ts < 2."""
    alone = table1(weight=((1e-12, 0.0), (0.0, 1e-12)), robust_gain=0.0)
    g = small_signal.gains(alone)
    assert axis_forms.largest_sampling_time(alone) == pytest.approx(g.pole / g.b2, rel=1e-6)
    assert g.pole / g.b2 == pytest.approx(7.12e-3, rel=1e-3)
    frozen = table1(adaptation=0.0)
    assert axis_forms.largest_sampling_time(frozen) == pytest.approx(2 / g.pole, rel=1e-6)
    slow_pole = table1(adaptation=0.0, pole=10.0)
    assert axis_forms.largest_sampling_time(slow_pole) == pytest.approx(19.6e-3, rel=0.02)
