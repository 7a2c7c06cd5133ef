"""Elementary functions against SciPy and NumPy, and the same bits however they are computed."""

import jax
import jax.numpy as jnp
import jax.scipy.special as special
import numpy as np
import pytest
import scipy.special

from simdjit.graph import Graph
from simdjit.lowering import evaluate, nodes_of
from simdjit.tracing import Traced

pytestmark = pytest.mark.compiler

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
    "exp2": (jnp.exp2, np.exp2, (-1020, 1020), 2),
    "sinh_large": (jnp.sinh, np.sinh, (-710.4, 710.4), 3),
    "arcsinh": (jnp.arcsinh, np.arcsinh, (-1e3, 1e3), 3),
    "arccosh": (jnp.arccosh, np.arccosh, (1, 1e3), 3),
    "arctanh": (jnp.arctanh, np.arctanh, (-1, 1), 3),
    "arcsinh_far": (jnp.arcsinh, np.arcsinh, (-1e12, 1e12), 2),
    "cbrt": (jnp.cbrt, lambda x: np.cbrt(x.astype(np.longdouble)).astype(float), (-1e3, 1e3), 1),
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


def test_far_angles(in_lanes):
    """Any finite angle, by as many digits of 2/pi as it takes."""
    rng = np.random.default_rng(3)
    x = rng.choice([-1, 1], 4000) * 10 ** rng.uniform(5.9, 308, 4000)
    for name in ("sin", "cos"):
        wanted = getattr(np, name)(x)
        assert (np.abs(in_lanes(getattr(jnp, name))(x) - wanted) / np.spacing(np.abs(wanted))).max() <= 3
        single = x[np.abs(x) < 1e38].astype(np.float32)
        wanted = getattr(np, name)(single.astype(float))
        found = in_lanes(getattr(jnp, name))(single)
        assert (np.abs(found - wanted) / np.spacing(np.abs(wanted.astype(np.float32)))).max() <= 2
    # One of all doubles is nearest to a multiple of pi/2 (Kahan).
    worst = np.array([6381956970095103.0 * 2.0**797])
    np.testing.assert_allclose(in_lanes(jnp.cos)(worst), -4.687165924254624e-19, rtol=1e-15)
    assert np.isnan(in_lanes(jnp.sin)(np.array([np.inf, -np.inf, np.nan]))).all()


def test_near_and_far_angles_side_by_side_have_the_bits_they_have_alone(in_lanes):
    x = np.array([0.5, 1e22, -3.0, 1e7, 2.0, -1e300, 1e6, 7.0])
    for function in (jnp.sin, jnp.cos):
        many = in_lanes(function)(x)
        np.testing.assert_array_equal(many, [in_lanes(function, constant=(0,))(np.array([one]))[0] for one in x])
        np.testing.assert_array_equal(many, in_lanes(function, lanes=1)(x))


def test_powers(in_lanes):
    """Within two units of the last place, up to where doubles end."""
    rng = np.random.default_rng(5)
    usual = rng.uniform(0, 5, 4000), rng.uniform(-3, 3, 4000)
    large = np.exp(rng.uniform(-2.3, 2.3, 4000)), rng.uniform(-300, 300, 4000)
    for x, y in (usual, large):
        wanted = x.astype(np.longdouble) ** y
        assert (np.abs(in_lanes(jnp.power)(x, y) - wanted) / np.spacing(wanted.astype(float))).max() <= 2
    np.testing.assert_allclose(in_lanes(lambda x: x**-3)(x), x**-3.0, rtol=1e-15)


BASES = [0.0, -0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.5, 1e300, np.inf, -np.inf, np.nan]
EXPONENTS = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 0.5, -0.5, 1e300, -1e300, 2.0**53 + 2, np.inf, -np.inf, np.nan]


@pytest.mark.parametrize("constant", [(), (1,)])
def test_powers_are_those_of_ieee_754(in_lanes, constant):
    """Negative bases, nothing to a negative power, and whatever is no number; an exponent that is built in, too."""
    for y in EXPONENTS:
        x, y = np.array(BASES), np.full(len(BASES), y)
        with np.errstate(all="ignore"):
            wanted = np.power(x, y)
        np.testing.assert_allclose(in_lanes(jnp.power, constant=constant)(x, y), wanted, rtol=3e-16, err_msg=str(y))
    x = np.array([-2.0, 3.0, 0.0])
    with jax.numpy_dtype_promotion("standard"):
        np.testing.assert_array_equal(in_lanes(lambda x: jnp.vander(x, 3))(x[:, None])[:, 0], np.vander(x, 3))
        np.testing.assert_array_equal(in_lanes(jnp.power)(x, np.array([3, 3, -1])), [-8.0, 27.0, np.inf])
    np.testing.assert_array_equal(in_lanes(lambda x: x ** jnp.arange(3.0))(x), x[:, None] ** np.arange(3.0))
    np.testing.assert_array_equal(in_lanes(jax.lax.pow)(x, np.array([3, 3, -1])), [-8.0, 27.0, np.inf])


EDGES = np.array(
    [0.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 5e-324, 709.7, 710.3, -708.3, 1000.0, -1000.0, 1.0, -1.0]
)


@pytest.mark.parametrize(
    "name",
    ["exp", "expm1", "log", "log1p", "tanh", "arctan", "sqrt", "sinh", "cosh", "exp2", "arcsinh", "arccosh", "arctanh"],
)
def test_what_is_no_number_stays_none(in_lanes, name):
    function, expected = FUNCTIONS[name][:2]
    with np.errstate(all="ignore"):
        wanted = expected(EDGES)
    found = in_lanes(function)(EDGES)
    alone = [in_lanes(function, constant=(0,))(np.array([value]))[0] for value in EDGES]
    np.testing.assert_array_equal(found, alone)
    sound = ~((np.abs(wanted) < 1e-300) | (np.abs(EDGES) == 5e-324))  # numbers below the ordinary ones are not kept
    np.testing.assert_allclose(found[sound], wanted[sound], rtol=1e-15)


def test_extremes_pass_on_what_is_no_number(in_lanes):
    x, y = np.array([[1.0, np.nan], [np.nan, 1.0], [2.0, 1.0], [1.0, 2.0]]).T
    np.testing.assert_array_equal(in_lanes(jnp.maximum)(x, y), np.maximum(x, y))
    np.testing.assert_array_equal(in_lanes(jnp.minimum)(x, y), np.minimum(x, y))
    np.testing.assert_array_equal(in_lanes(lambda x: jnp.clip(x, -1.5, 1.5))(x), np.clip(x, -1.5, 1.5))
    for which in ((0,), (1,), (0, 1)):
        for a, b in zip(x, y, strict=True):
            pair = np.array([a, a]), np.array([b, b])
            for function, wanted in ((jnp.maximum, np.maximum), (jnp.minimum, np.minimum)):
                np.testing.assert_array_equal(in_lanes(function, constant=which)(*pair), wanted(*pair))


def test_angles_of_points_infinitely_far(in_lanes):
    places = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1.7e308, 0.9e308]
    y, x = np.array([(y, x) for y in places for x in places]).T
    np.testing.assert_allclose(in_lanes(jnp.arctan2)(y, x), np.arctan2(y, x), rtol=3e-16)
