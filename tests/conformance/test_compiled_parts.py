"""Every part of the catalogue under jit, vmap and grad: same values, finite gradients, no second trace."""

import operator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from use_of_parts import NUMBERS, USES, numbers

from undertow.core import catalogue


def inputs(rows):
    return jnp.asarray(np.random.default_rng(8).uniform(-1, 1, (rows, NUMBERS)))


def test_every_kind_has_a_use():
    assert set(USES) == set(catalogue.KINDS)


def test_same_values_compiled_and_batched(part):
    """jit = no jit, vmap = loop; and the numbers are finite and not all zero for some input."""
    kind, thing = part
    batch = inputs(3)
    with jax.disable_jit():
        plain = np.asarray(numbers(kind, thing, batch[0]))
    compiled = eqx.filter_jit(lambda thing, v: numbers(kind, thing, v))
    looped = np.stack([np.asarray(compiled(thing, v)) for v in batch])
    batched = np.asarray(
        eqx.filter_jit(eqx.filter_vmap(lambda thing, v: numbers(kind, thing, v), in_axes=(None, 0)))(thing, batch)
    )
    assert plain.size and np.isfinite(plain).all()
    np.testing.assert_allclose(looped[0], plain, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(batched, looped, rtol=1e-10, atol=1e-12)


def test_parameters_may_be_batched(part):
    """A batch of parts with parameters of their own is a loop over parts."""
    kind, thing = part
    arrays, rest = eqx.partition(thing, eqx.is_inexact_array)
    many = jax.tree.map(lambda leaf: jnp.stack([leaf, 1.01 * leaf]), arrays)
    v = inputs(1)[0]

    @eqx.filter_jit
    def use(arrays):
        return numbers(kind, eqx.combine(arrays, rest), v)

    looped = np.stack([np.asarray(use(jax.tree.map(operator.itemgetter(i), many))) for i in range(2)])
    if jax.tree.leaves(arrays):
        batched = np.asarray(eqx.filter_jit(eqx.filter_vmap(use))(many))
        np.testing.assert_allclose(batched, looped, rtol=1e-10, atol=1e-12)
    else:
        np.testing.assert_array_equal(looped[0], looped[1])


def test_finite_gradients(part):
    """With respect to every parameter and every number that comes in."""
    kind, thing = part
    arrays, rest = eqx.partition(thing, eqx.is_inexact_array)
    total = lambda arrays, v: numbers(kind, eqx.combine(arrays, rest), v).sum()
    gradients = eqx.filter_jit(jax.grad(total, argnums=(0, 1)))(arrays, inputs(1)[0])
    for leaf in jax.tree.leaves(gradients):
        assert np.isfinite(np.asarray(leaf)).all()


def test_no_retrace_for_another_value(part):
    kind, thing = part
    traces = []

    @eqx.filter_jit
    def use(thing, v):
        traces.append(kind)
        return numbers(kind, thing, v)

    v = inputs(1)[0]
    arrays, rest = eqx.partition(thing, eqx.is_inexact_array)
    other = eqx.combine(jax.tree.map(lambda leaf: jnp.where(jnp.isfinite(leaf), 1.01 * leaf + 0.01, 1.0), arrays), rest)
    first, second = np.asarray(use(thing, v)), np.asarray(use(other, v))
    assert len(traces) == 1
    if jax.tree.leaves(arrays):
        assert (first != second).any(), "the parameters have no effect at all"
