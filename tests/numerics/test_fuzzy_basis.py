"""I11: the fuzzy basis sums to one, stays finite however far the input, and is the printed formula where that exists."""

import jax
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from undertow.control.estimation import FuzzySystem, gaussian_sets
from undertow.control.estimation.fuzzy_system import even_memberships, is_even, memberships
from undertow.core import runtime
from undertow.core.errors import BadInput

EPSILON = np.finfo(float).eps
LAYOUTS = [(1, None), (2, None), (3, None), (3, 0.5), (5, None), (5, 0.25), (7, None), (7, 1.0), (15, None), (25, None)]
LAYOUTS += [(26, None), (27, 0.04), (50, None), (51, 0.5), (100, None)]  # with several exponentials
UNEVEN = FuzzySystem(np.array([[-2.0, -0.3, 0.1, 1.5]]), np.array([[1.0, 0.2, 0.4, 0.7]]))
EVEN = {(count, width): gaussian_sets(count, (0.3,), width) for count, width in LAYOUTS}
SYSTEMS = {**EVEN, "uneven": UNEVEN}
QUICK = {(5, None), (7, 1.0), (26, None), "uneven"}  # few and many sets, wide ones, and those without a quick way


def cells(names):
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.full) for name in names]


FAR = np.logspace(-6, 6, 600)
FAR = np.concatenate([-FAR[::-1], [0.0], FAR, np.linspace(-3, 3, 1001)])  # in widths

basis = jax.jit(lambda system, x: system.basis(x[:, None]))
estimate = jax.jit(lambda system, theta, x: system.output(theta, system.basis(x[:, None])))


def inputs_of(system):
    """Inputs up to 1e6 widths away, in the unit of the input."""
    return FAR * np.asarray(system.widths).max()


def direct(system, x):
    """Eq. (37) as printed; NaN where it is 0/0."""
    with np.errstate(under="ignore", invalid="ignore", divide="ignore"):
        mu = np.exp(-(((x[:, None] - np.asarray(system.centres)[0]) / np.asarray(system.widths)[0]) ** 2))
        total = mu.sum(1, keepdims=True)
        return np.where(total > 0, mu / total, np.nan)


@pytest.mark.parametrize("name", cells(SYSTEMS))
def test_basis_is_a_partition_of_unity_up_to_a_million_widths(name):
    system = SYSTEMS[name]
    xi = np.asarray(basis(system, inputs_of(system)))
    assert np.isfinite(xi).all()
    assert (xi >= 0).all()
    assert np.abs(xi.sum(1) - 1).max() <= 4 * EPSILON


@pytest.mark.parametrize("name", cells(SYSTEMS))
def test_square_of_the_basis_lies_between_one_over_rules_and_one(name):
    system = SYSTEMS[name]
    square = (np.asarray(basis(system, inputs_of(system))) ** 2).sum(1)
    assert square.min() >= 1 / system.rules * (1 - 4 * EPSILON)
    assert square.max() <= 1 + 4 * EPSILON


@pytest.mark.parametrize("name", cells(SYSTEMS))
def test_basis_is_the_printed_formula_where_that_is_finite(name):
    system = SYSTEMS[name]
    x = inputs_of(system)
    expected = direct(system, x)
    finite = np.isfinite(expected).all(1)
    assert 0.5 < finite.mean() < 1  # the printed formula does fail, and not everywhere
    np.testing.assert_allclose(np.asarray(basis(system, x))[finite], expected[finite], rtol=0, atol=1e-14)


@pytest.mark.parametrize("layout", cells([layout for layout in LAYOUTS if EVEN[layout].evenly_spaced]))
def test_quick_way_for_even_sets_is_the_general_way(layout):
    system = EVEN[layout]
    x, centres, widths = inputs_of(system), np.asarray(system.centres)[0], np.asarray(system.widths)[0]
    quick = jax.jit(even_memberships)(x, centres, widths)
    np.testing.assert_allclose(quick, jax.jit(memberships)(x, centres, widths), rtol=0, atol=1e-14)


def test_quick_way_is_taken_only_where_it_holds():
    assert [EVEN[layout].evenly_spaced for layout in LAYOUTS] == [count > 1 for count, _ in LAYOUTS]
    assert not is_even(np.array([-1.0, 0.0, 1.1]), np.ones(3))
    assert not is_even(np.array([-1.0, 0.0, 1.0]), np.array([1.0, 1.0, 0.9]))
    assert not is_even(np.array([1.0, 0.0, -1.0]), np.ones(3))
    assert not gaussian_sets(51, (1.0,), 0.01).evenly_spaced  # exp(4e4) would overflow
    assert np.isfinite(basis(gaussian_sets(51, (1.0,), 0.01), np.linspace(-2, 2, 101))).all()


@pytest.mark.parametrize("count", [9, *(pytest.param(count, marks=pytest.mark.full) for count in (5, 20, 50))])
def test_single_precision(count):
    with runtime.in_precision("float32"):
        system = gaussian_sets(count)
        x = np.linspace(-2, 2, 101, dtype=np.float32)
        found = np.asarray(jax.jit(FuzzySystem.basis)(system, x[:, None]))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, direct(gaussian_sets(count), x.astype(float)), rtol=0, atol=3e-6)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    # XLA flushes subnormal numbers to zero: a weight, and a weight times its share.
    weights=st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=5, max_size=5),
    x=st.floats(-1e6, 1e6, allow_nan=False),
    layout=st.sampled_from([(5, None), (5, 0.25)]),
)
def test_estimate_stays_within_the_weights(weights, x, layout):
    system = EVEN[layout]
    theta = np.array([weights])
    d_hat = float(np.asarray(estimate(system, theta, np.array([x])))[0])
    slack = 8 * EPSILON * np.abs(theta).max() + theta.size * np.finfo(float).tiny
    assert theta.min() - slack <= d_hat <= theta.max() + slack


@pytest.mark.parametrize("evenly_spaced", [False, True])
def test_two_inputs_multiply_and_normalise(evenly_spaced):
    """Eq. (37) with products of Gaussians over a 5 x 5 grid, first input slowest."""
    system = gaussian_sets(5, (4.0, 2.0), 0.7)
    system = FuzzySystem(system.centres, system.widths, evenly_spaced=evenly_spaced)
    x = np.random.default_rng(0).uniform(-8, 8, (500, 2))
    mu = np.exp(-(((x[:, :, None] - np.asarray(system.centres)) / np.asarray(system.widths)) ** 2))
    products = (mu[:, 0, :, None] * mu[:, 1, None, :]).reshape(500, 25)
    expected = products / products.sum(1, keepdims=True)
    found = np.asarray(jax.jit(FuzzySystem.basis)(system, x))
    assert system.rules == 25
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
    assert np.abs(found.sum(1) - 1).max() <= 4 * EPSILON


def test_impossible_sets_are_refused():
    with pytest.raises(BadInput, match="`sets` must be 1 or more"):
        gaussian_sets(0)
    with pytest.raises(BadInput, match="`widths"):
        FuzzySystem(np.zeros((1, 3)), np.array([[1.0, 0.0, 1.0]]))
    with pytest.raises(BadInput, match="`centres`"):
        FuzzySystem(np.zeros((1, 3)), np.ones((1, 2)))
