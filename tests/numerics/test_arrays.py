"""Arrays of parameters: one for the same numbers, never another's, and never of a trace that is over."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import runtime
from undertow.core.arrays import as_array, library_of
from undertow.core.numerics.random_keys import key_of_seed


@pytest.mark.parametrize("value", [2, 2.5, True, [1.0, 2.0], [[1, 2], [3, 4]], (), np.eye(3), -0.0, np.nan, np.inf])
def test_the_numbers_are_those_given(value):
    found, wanted = as_array(value), np.asarray(value, dtype=float)
    assert found.shape == wanted.shape and found.dtype == wanted.dtype
    assert np.asarray(found).tobytes() == wanted.tobytes()  # the sign of zero, too


def test_the_same_numbers_are_one_array():
    assert as_array([1.5, 2.5]) is as_array(np.array([1.5, 2.5]))
    assert as_array(3) is as_array(3.0) and as_array(3.0) is not as_array([3.0])
    assert as_array(0.0) is not as_array(-0.0)


def test_what_is_an_array_stays_it():
    given = jnp.arange(3)
    assert as_array(given) is given
    assert as_array([jnp.ones(2), np.zeros(2)]).shape == (2, 2)


def test_nobody_can_change_it_by_the_array_it_came_from():
    source = np.array([7.0, 8.0])
    found = as_array(source)
    source[0] = 0.0
    np.testing.assert_array_equal(found, [7.0, 8.0])
    np.testing.assert_array_equal(as_array(source), [0.0, 8.0])


def test_large_arrays_are_made_anew():
    large = np.arange(1000.0)
    assert as_array(large) is not as_array(large)
    np.testing.assert_array_equal(as_array(large), large)


def test_made_while_jax_traces_it_serves_later():
    """Negative control: what JAX makes within a trace is of no use after it."""
    left = []

    @jax.jit
    def traced(x):
        left.append((as_array(41.75), jnp.asarray(x)))
        return x + left[0][0]

    assert float(traced(1.0)) == 42.75
    made, leaked = left[0]
    assert float(as_array(41.75) + made) == 83.5
    with pytest.raises(jax.errors.UnexpectedTracerError):
        _ = leaked + 1.0


def test_precision_and_device_are_those_of_the_moment():
    double = as_array(0.1)
    with runtime.in_precision("float32"):
        single = as_array(0.1)
    assert (double.dtype, single.dtype) == (np.float64, np.float32)
    with runtime.on_processor():
        assert as_array(0.1) is not double and as_array(0.1) is as_array(0.1)
    assert as_array(0.1) is double


def test_known_numbers_are_computed_by_numpy_with_the_bits_of_jax():
    chance = np.random.default_rng(0)
    a, b = (as_array(chance.lognormal(size=100)) for _ in range(2))
    assert library_of(a, b) is np
    for name in ("add", "multiply", "divide"):
        assert np.array_equal(getattr(np, name)(a, b), getattr(jnp, name)(a, b))
    assert np.array_equal(1 / np.sqrt(a), 1 / jnp.sqrt(a))
    libraries = []
    jax.eval_shape(lambda x: libraries.append(library_of(x, 2.0)), a)
    assert libraries == [jnp]


@pytest.mark.parametrize("seed", [0, 1, 20170212, 2**32 - 1, 2**32, 2**40 + 3, -1])
def test_the_key_of_a_seed_is_that_of_jax(seed):
    assert np.array_equal(key_of_seed(seed), jax.random.PRNGKey(seed))
    assert key_of_seed(seed).dtype == np.uint32
