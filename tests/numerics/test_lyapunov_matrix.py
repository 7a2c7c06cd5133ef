"""I10: P of Eq. (21) solves its equation, is positive definite, and gains that cannot have one are refused."""

import jax
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov

from undertow.control.controllers import rcaf
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import companion_lyapunov
from undertow.physics.plants import double_integrator

RNG = np.random.default_rng(3)
COUNT = 200
FEEDBACK = 10 ** RNG.uniform(-1.5, 1.5, (COUNT, 2))
FACTORS = RNG.normal(size=(COUNT, 2, 2))
WEIGHTS = FACTORS @ FACTORS.swapaxes(1, 2) + 0.1 * np.eye(2)
A = np.stack([np.array([[0, 1], [-k1, -k2]]) for k1, k2 in FEEDBACK])
lyapunov = jax.jit(companion_lyapunov)
P = np.asarray(lyapunov(FEEDBACK, WEIGHTS))


def test_table_1_gives_the_matrix_of_the_theory():
    p = lyapunov(np.array([1.0, 2.0]), 10 * np.eye(2))
    np.testing.assert_allclose(p, [[15, 5], [5, 5]], rtol=0, atol=1e-12)
    law = rcaf(double_integrator(axes=6).model(), preset="paper")
    np.testing.assert_allclose(jax.jit(lambda: law.lyapunov())(), [[15, 5], [5, 5]], rtol=0, atol=1e-12)


def test_equation_holds():
    """||A^T P + P A + Q|| <= 1e-12 ||Q||."""
    left = A.swapaxes(1, 2) @ P
    residual = np.linalg.norm(left + left.swapaxes(1, 2) + WEIGHTS, axis=(1, 2))
    assert (residual <= 1e-12 * np.linalg.norm(WEIGHTS, axis=(1, 2))).all()


def test_matrix_is_symmetric_and_positive_definite():
    np.testing.assert_array_equal(P, P.swapaxes(1, 2))
    assert np.linalg.eigvalsh(P).min() > 0


def test_closed_form_agrees_with_a_general_solver():
    expected = np.stack([solve_continuous_lyapunov(a.T, -q) for a, q in zip(A, WEIGHTS, strict=True)])
    np.testing.assert_allclose(P, expected, rtol=1e-9)


def test_law_uses_the_second_column_of_each_axis():
    """s = E^T P b with one K and Q per axis."""
    law = rcaf(double_integrator(axes=3).model(), preset="paper", feedback=FEEDBACK[:3], weight=WEIGHTS[:3])
    np.testing.assert_allclose(jax.jit(lambda: law.lyapunov())(), P[:3], rtol=1e-13)


bad = st.one_of(st.floats(-1e3, 0), st.sampled_from([np.nan, np.inf, -np.inf]))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(wrong=bad, right=st.floats(1e-2, 1e2), place=st.integers(0, 1), axis=st.one_of(st.none(), st.integers(0, 2)))
def test_feedback_that_is_not_hurwitz_is_refused_by_name(wrong, right, place, axis):
    pair = [right, right]
    pair[place] = wrong
    feedback = pair if axis is None else [pair if i == axis else [1.0, 2.0] for i in range(3)]
    with pytest.raises(BadInput) as caught:
        rcaf(double_integrator(axes=3).model(), preset="paper", feedback=feedback)
    assert caught.value.name.startswith("feedback")


@pytest.mark.parametrize(
    ("weight", "must"),
    [
        ([[1.0, 0.0], [0.0, -1.0]], "positive definite"),
        ([[1.0, 1.0], [1.0, 1.0]], "positive definite"),
        ([[1.0, 2.0], [2.0, 1.0]], "positive definite"),
        ([[0.0, 0.0], [0.0, 0.0]], "positive definite"),
        ([[1.0, 0.5], [0.4, 1.0]], "symmetric"),
        ([[1.0, np.nan], [np.nan, 1.0]], "finite"),
        ([1.0, 2.0], r"shape \(2,\)"),
        ([[[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]]], "positive definite"),
    ],
)
def test_weight_that_is_not_positive_definite_is_refused_by_name(weight, must):
    with pytest.raises(BadInput, match=must) as caught:
        rcaf(double_integrator(axes=2).model(), preset="paper", weight=weight)
    assert caught.value.name.startswith("weight")
