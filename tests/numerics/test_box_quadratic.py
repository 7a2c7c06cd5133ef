"""Box-constrained quadratics against SciPy's bounded least squares and against what an optimum must satisfy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from undertow.core.numerics.box_quadratic import box_minimum
from undertow.core.numerics.linear_algebra import inverse_symmetric, solve_symmetric

RNG = np.random.default_rng(11)
solve = jax.jit(box_minimum)


def problem(n, tightness):
    d = RNG.uniform(0.1, 2.0, n)
    f = RNG.normal(size=(n + 3, n))
    f[RNG.integers(1, n + 4) :] = 0.0  # often fewer rows than variables
    c = 3 * RNG.normal(size=n)
    low = -tightness * RNG.uniform(0.1, 1.0, n)
    high = tightness * RNG.uniform(0.1, 1.0, n)
    return d, f, c, low, high


def by_least_squares(d, f, c, low, high):
    """The same problem as |A x - b|^2 with A = [F; sqrt D], by SciPy."""
    a = np.concatenate([f, np.diag(np.sqrt(d))])
    b = np.concatenate([np.zeros(len(f)), c / np.sqrt(d)])
    return lsq_linear(a, b, (low, high), method="bvls", tol=1e-14, max_iter=1000).x


@pytest.mark.parametrize("n", [5, *(pytest.param(n, marks=pytest.mark.full) for n in (1, 2, 9, 12))])
@pytest.mark.parametrize("tightness", [0.1, 1.0, 10.0])
def test_agrees_with_bounded_least_squares(n, tightness):
    for _ in range(40):
        given = problem(n, tightness)
        np.testing.assert_allclose(solve(*given), by_least_squares(*given), rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("weight", [1.0, 1e6])
@pytest.mark.parametrize("n", [8, pytest.param(32, marks=pytest.mark.full)])
def test_allocations_of_many_thrusters(n, weight):
    """As thruster_allocation.py poses them: little weight on each of many variables, much on few combinations."""
    for _ in range(10):
        f = np.sqrt(weight) * RNG.normal(size=(6, n + 1))
        d, c = np.full(n + 1, 1e-6), np.zeros(n + 1)
        d[n] = c[n] = 1.0
        low, high = -RNG.uniform(0.02, 0.2, n + 1), RNG.uniform(0.02, 0.2, n + 1)
        low[n], high[n] = 0.0, 1.0
        given = d, f, c, low, high
        np.testing.assert_allclose(solve(*given), by_least_squares(*given), rtol=1e-7, atol=1e-8)


@pytest.mark.full
@pytest.mark.parametrize("count", [1_000, pytest.param(10_000, marks=pytest.mark.slow)])
def test_optimality_of_many(count):
    """Inside: no slope. At a bound: the slope points outwards. That is all there is for a convex function."""
    problems = [problem(9, 10.0 ** RNG.uniform(-2, 1)) for _ in range(count)]
    d, f, c, low, high = (np.stack(parts) for parts in zip(*problems, strict=True))
    x = np.asarray(jax.jit(jax.vmap(box_minimum))(d, f, c, low, high))
    slope = d * x + np.einsum("kij,kil,kl->kj", f, f, x) - c
    assert ((x >= low) & (x <= high)).all()
    inside = (x > low) & (x < high)
    size = np.abs(c).max(1, keepdims=True)
    assert (np.abs(slope / size)[inside] < 1e-9).all()
    assert ((slope / size)[x <= low] > -1e-9).all()
    assert ((slope / size)[x >= high] < 1e-9).all()


def test_a_box_without_an_inside_is_its_point():
    d, f, c, low, _ = problem(4, 1.0)
    np.testing.assert_array_equal(solve(d, f, c, low, low), low)


def test_a_variable_may_be_held():
    d, f, c, low, high = problem(4, 5.0)
    low[2] = high[2] = 0.7
    rest = [0, 1, 3]
    expected = by_least_squares(d[rest], f[:, rest], c[rest] - 0.7 * f[:, rest].T @ f[:, 2], low[rest], high[rest])
    found = solve(d, f, c, low, high)
    np.testing.assert_allclose(np.asarray(found)[rest], expected, rtol=1e-8, atol=1e-9)
    assert float(found[2]) == 0.7


def test_slope_along_one_direction_of_everything():
    """Against a small change of all that is given; some variables are at a bound, others inside."""
    rng = np.random.default_rng(3)
    given = (rng.uniform(0.5, 2.0, 6), rng.normal(size=(3, 6)), np.array([9.0, -9.0, 0.3, 0.2, -0.1, 0.4]))
    given = tuple(map(jnp.asarray, (*given, np.full(6, -0.8), np.full(6, 0.9))))
    direction = tuple(jnp.asarray(rng.normal(size=one.shape)) for one in given)
    x, slope = jax.jit(lambda a, b: jax.jvp(box_minimum, a, b))(given, direction)
    near = [solve(*(one + step * way for one, way in zip(given, direction, strict=True))) for step in (1e-6, -1e-6)]
    np.testing.assert_allclose(slope, (np.asarray(near[0]) - near[1]) / 2e-6, rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(x, solve(*given))
    at_low, at_high = np.asarray(x) == given[3], np.asarray(x) == given[4]
    assert at_low.any() and at_high.any() and not (at_low | at_high).all()
    np.testing.assert_array_equal(np.asarray(slope)[at_low], np.asarray(direction[3])[at_low])
    np.testing.assert_array_equal(np.asarray(slope)[at_high], np.asarray(direction[4])[at_high])


@pytest.mark.full
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_are_those_of_small_changes(mode):
    """Away from a change of the active set, which random problems do not meet."""
    arguments = tuple(map(jnp.asarray, problem(6, 1.0)))
    for i, value in enumerate(arguments):
        found = np.asarray(jax.jit(mode(box_minimum, argnums=i))(*arguments)).reshape(6, -1)
        for k in range(0, value.size, 5):
            nudge = np.zeros(value.size)
            nudge[k] = 1e-6
            apart = [
                np.asarray(solve(*arguments[:i], value + sign * nudge.reshape(value.shape), *arguments[i + 1 :]))
                for sign in (1, -1)
            ]
            np.testing.assert_allclose(found[:, k], (apart[0] - apart[1]) / 2e-6, rtol=1e-5, atol=1e-7)


def test_symmetric_systems():
    a = RNG.normal(size=(8, 8))
    h, b = a @ a.T + np.eye(8), RNG.normal(size=8)
    np.testing.assert_allclose(jax.jit(solve_symmetric)(h, b), np.linalg.solve(h, b), rtol=1e-11)
    np.testing.assert_allclose(np.asarray(jax.jit(inverse_symmetric)(h)) @ h, np.eye(len(h)), atol=1e-10)
