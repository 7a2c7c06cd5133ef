"""Elementary functions against SciPy and NumPy, and the same bits however they are computed."""

import jax.numpy as jnp
import jax.scipy.special as special
import numpy as np
import pytest
import scipy.special

from undertow.lanes.graph import Graph
from undertow.lanes.scalarise import evaluate, nodes_of
from undertow.lanes.tracing import Traced

# Function, what it must equal, where, and how far it may be off in units of the last place.
FUNCTIONS = {
    "exp": (jnp.exp, np.exp, (-700, 700), 2),
    "exp_small": (jnp.exp, np.exp, (-1, 1), 1),
    "expm1": (jnp.expm1, np.expm1, (-1, 1), 3),
    "expm1_large": (jnp.expm1, np.expm1, (-40, 700), 3),
    "log": (jnp.log, np.log, (1e-3, 1e3), 2),
    "log_tiny": (jnp.log, np.log, (1e-300, 1e-290), 2),
    "log1p": (jnp.log1p, np.log1p, (-0.9, 3), 3),
    "log1p_small": (jnp.log1p, np.log1p, (-1e-8, 1e-8), 2),
    "sin": (jnp.sin, np.sin, (-3.1, 3.1), 2),
    "cos": (jnp.cos, np.cos, (-1.5, 1.5), 2),
    "tan": (jnp.tan, np.tan, (-1.5, 1.5), 4),
    "tanh": (jnp.tanh, np.tanh, (-25, 25), 4),
    "tanh_small": (jnp.tanh, np.tanh, (-1e-3, 1e-3), 4),
    "sinh": (jnp.sinh, np.sinh, (-30, 30), 4),
    "cosh": (jnp.cosh, np.cosh, (-30, 30), 3),
    "arctan": (jnp.arctan, np.arctan, (-50, 50), 2),
    "arctan_small": (jnp.arctan, np.arctan, (-0.5, 0.5), 2),
    "arcsin": (jnp.arcsin, np.arcsin, (-1, 1), 4),
    "arccos": (jnp.arccos, np.arccos, (-1, 0.99), 4),
    "erf_inv": (special.erfinv, scipy.special.erfinv, (-0.99999, 0.99999), 12),
    "sqrt": (jnp.sqrt, np.sqrt, (0, 1e9), 0.5),
    "rsqrt": (lambda x: 1 / jnp.sqrt(x), lambda x: 1 / np.sqrt(x), (1e-9, 1e9), 0.5),
    "logistic": (lambda x: 1 / (1 + jnp.exp(-x)), scipy.special.expit, (-30, 30), 6),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_within_a_few_units_of_the_last_place(in_lanes, name):
    function, expected, bounds, units = FUNCTIONS[name]
    x = np.random.default_rng(1).uniform(*bounds, 4000)
    found, wanted = in_lanes(function)(x), expected(x)
    assert (np.abs(found - wanted) / np.spacing(np.abs(wanted))).max() <= units


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_same_bits_in_any_width_and_as_constants(in_lanes, name):
    """Eight lanes, one lane, and NumPy working the constants out: the same bits."""
    function, _, bounds, _ = FUNCTIONS[name]
    x = np.random.default_rng(2).uniform(*bounds, 64)
    found = in_lanes(function)(x)
    np.testing.assert_array_equal(in_lanes(function, lanes=1)(x), found)
    traced = Traced(function, jnp.asarray(1.0))
    for value, result in zip(x, found, strict=True):
        graph = Graph()
        (node,) = evaluate(graph, traced.closed, [nodes_of(graph, value)])
        assert graph.value(int(node)) == result


def test_angles_of_many_turns(in_lanes):
    """Absolute error: what is near a multiple of pi has no digits of its own."""
    x = np.random.default_rng(3).uniform(-1e6, 1e6, 4000)
    assert np.abs(in_lanes(jnp.sin)(x) - np.sin(x)).max() < 3e-16
    assert np.abs(in_lanes(jnp.cos)(x) - np.cos(x)).max() < 3e-16


def test_angle_of_a_point(in_lanes):
    y, x = np.random.default_rng(4).normal(size=(2, 4000))
    found, wanted = in_lanes(jnp.arctan2)(y, x), np.arctan2(y, x)
    assert (np.abs(found - wanted) / np.spacing(np.abs(wanted))).max() <= 3
    edges = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [-1.0, 0.0], [1e-300, -1.0]])
    np.testing.assert_array_equal(in_lanes(jnp.arctan2)(*edges.T), np.arctan2(*edges.T))


def test_powers(in_lanes):
    x, y = np.random.default_rng(5).uniform([0.0, -3.0], [5.0, 3.0], (4000, 2)).T
    np.testing.assert_allclose(in_lanes(jnp.power)(x, y), x**y, rtol=1e-14)
    np.testing.assert_allclose(in_lanes(lambda x: x**-3)(x), x**-3.0, rtol=1e-15)
    np.testing.assert_array_equal(in_lanes(jnp.power)(np.array([0.0, 2.0]), np.array([2.0, 0.0])), [0.0, 1.0])


EDGES = np.array([0.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 5e-324])


@pytest.mark.parametrize("name", ["exp", "expm1", "log", "log1p", "tanh", "arctan", "sqrt"])
def test_what_is_no_number_stays_none(in_lanes, name):
    function, expected = FUNCTIONS[name][:2]
    with np.errstate(all="ignore"):
        wanted = expected(EDGES)
    found = in_lanes(function)(EDGES)
    sound = ~((np.abs(wanted) < 1e-300) | (np.abs(EDGES) == 5e-324))  # numbers below the ordinary ones are not kept
    np.testing.assert_allclose(found[sound], wanted[sound], rtol=1e-15)


def test_extremes_pass_on_what_is_no_number(in_lanes):
    x, y = np.array([[1.0, np.nan], [np.nan, 1.0], [2.0, 1.0], [1.0, 2.0]]).T
    np.testing.assert_array_equal(in_lanes(jnp.maximum)(x, y), np.maximum(x, y))
    np.testing.assert_array_equal(in_lanes(jnp.minimum)(x, y), np.minimum(x, y))
    np.testing.assert_array_equal(in_lanes(lambda x: jnp.clip(x, -1.5, 1.5))(x), np.clip(x, -1.5, 1.5))
