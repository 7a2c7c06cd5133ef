"""The cubic spline against scipy's, and the motion laws against their closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from undertow.core.numerics.motion_laws import quintic, rounded_ramp, with_rates
from undertow.core.numerics.spline import clamped_slopes, spline


def rows(count, columns=3, seed=0):
    """Unevenly spaced knots, and values."""
    random = np.random.default_rng(seed)
    return np.cumsum(random.uniform(0.1, 2.0, count)) - 1.0, random.normal(size=(count, columns))


def evaluated(knots, values, t):
    found = _evaluated(np.resize(t, 400), knots, values, clamped_slopes(knots, values))
    return [np.asarray(part)[: len(t)] for part in found]


_evaluated = jax.jit(jax.vmap(spline, (0, None, None, None)))


@pytest.mark.parametrize("count", [8, *(pytest.param(count, marks=pytest.mark.full) for count in (2, 3, 50))])
def test_same_as_scipy(count):
    knots, values = rows(count)
    theirs = CubicSpline(knots, values, bc_type="clamped")
    t = np.concatenate([np.linspace(knots[0], knots[-1], 301)[:-1], knots[:-1]])
    for order, ours in enumerate(evaluated(knots, values, t)):
        expected = theirs(t, order)
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


def test_slopes_are_scipys_for_many_rows():
    knots, values = rows(2000, 6, seed=1)
    expected = CubicSpline(knots, values, bc_type="clamped")(knots, 1)
    np.testing.assert_allclose(clamped_slopes(knots, values), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_held_outside():
    knots, values = rows(8)
    position, velocity, acceleration = evaluated(
        knots, values, np.array([-100.0, knots[0] - 1e-9, knots[-1] + 1e-9, 1e6])
    )
    np.testing.assert_allclose(position, values[[0, 0, -1, -1]], rtol=0, atol=1e-14)
    assert not velocity.any() and not acceleration.any()


def test_inner_knots_are_smooth():
    knots, values = rows(8)
    before, after = knots[1:-1] - 1e-9, knots[1:-1] + 1e-9
    for left, right in zip(evaluated(knots, values, before), evaluated(knots, values, after), strict=True):
        np.testing.assert_allclose(left, right, rtol=0, atol=1e-5)


def test_gradients_reach_every_knot():
    knots, values = rows(4)
    t = jnp.asarray(0.5 * (knots[1] + knots[2]))
    gradients = jax.jit(jax.grad(lambda *data: sum(part.sum() for part in spline(t, *data)), argnums=(0, 1, 2)))(
        knots, values, clamped_slopes(knots, values)
    )
    for gradient in map(np.asarray, gradients):
        assert np.isfinite(gradient).all() and gradient[1:3].all()


def rates(law, x):
    return map(np.asarray, jax.jit(jax.vmap(lambda x: with_rates(law, x)))(np.asarray(x)))


def test_quintic():
    value, rate, second = rates(quintic, [-1.0, 0.0, 0.5, 1.0, 2.0])
    np.testing.assert_array_equal(value, [0, 0, 0.5, 1, 1])
    np.testing.assert_array_equal(rate, [0, 0, 1.875, 0, 0])
    np.testing.assert_allclose(second, 0, atol=1e-14)
    extreme = 0.5 - np.sqrt(3) / 6
    np.testing.assert_allclose(list(rates(quintic, [extreme]))[2], 10 / np.sqrt(3), rtol=1e-14)


def test_rates_are_those_of_the_curve():
    x = np.linspace(-2.0, 2.0, 9)
    for found, expected in zip(
        rates(lambda t: jnp.sin(3 * t), x), (np.sin(3 * x), 3 * np.cos(3 * x), -9 * np.sin(3 * x)), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_rounded_ramp():
    """Height 6 at slope 2 with corners of 1: slope 2 from 1 to 3, at rest from 4 on; half a corner is lost."""
    value, slope, second = rates(
        lambda t: rounded_ramp(t, 6.0, 2.0, 1.0), [-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 9.0]
    )
    np.testing.assert_allclose(value, [0, 0, 2 * 3 / 32, 1, 3, 5, 6 - 2 * 3 / 32, 6, 6], rtol=0, atol=1e-14)
    np.testing.assert_allclose(slope, [0, 0, 1, 2, 2, 2, 1, 0, 0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(second, [0, 0, 3, 0, 0, 0, -3, 0, 0], rtol=0, atol=1e-13)


def test_short_ramp_stays_below_its_slope():
    value, slope, _ = rates(lambda t: rounded_ramp(t, 0.5, 2.0, 1.0), np.linspace(0.0, 1.25, 101))
    np.testing.assert_allclose(value[-1], 0.5, rtol=1e-14)
    assert (slope[1:-1] > 0).all() and 0.5 < slope.max() < 1.0
