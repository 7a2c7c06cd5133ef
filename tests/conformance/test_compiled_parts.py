"""Every part of the catalogue under jit, vmap and grad: same values, finite gradients, no second trace."""

import operator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from catalogue_parts import ALL, groups, make
from use_of_parts import NUMBERS, USES, numbers

from undertow.core import catalogue


def inputs(rows):
    return jnp.asarray(np.random.default_rng(8).uniform(-1, 1, (rows, NUMBERS)))


@pytest.mark.full
def test_every_kind_has_a_use():
    assert set(USES) == set(catalogue.KINDS)


# Their gradients take long to compile, and the quicker parts of their kind meet the same operations: slow tests.
HEAVY = {
    ("navigation", "kalman"),
    ("navigation", "observer"),
    ("navigation", "white_noise"),
    ("navigation", "degraded"),
    ("controllers", "rcaf:paper"),
    ("controllers", "indi"),
    ("controllers", "nmpc"),
    ("controllers", "neural"),
    ("controllers", "cascade:ardusub"),
    ("controllers", "cascade:px4"),
    ("vehicles", "bluerov2"),
    ("sensors", "imu"),
    ("disturbances", "random_suite"),
    ("disturbances", "gauss_markov_current"),
    ("disturbances", "waves"),
    ("supervision", "supervisor"),
}

# Operation by operation these take longest: without compilation they are met by the slow tests only.
LONG = {
    ("navigation", "kalman"),
    ("navigation", "observer"),
    ("disturbances", "gauss_markov_current"),
    ("disturbances", "waves"),
    ("controllers", "rcaf:robust"),
}


def moved(leaf):
    """Another value of a parameter."""
    return jnp.where(jnp.isfinite(leaf), 1.01 * leaf + 0.01, 1.0)


def plain(kind, thing, v):
    """Values without compilation."""
    with jax.disable_jit():
        return np.asarray(numbers(kind, thing, v))


TOGETHER = [pytest.param(pairs, id="/".join(pairs[0]), marks=pytest.mark.full) for pairs in groups(left_out=HEAVY)]
ALONE = [pytest.param([pair], id="/".join(pair), marks=pytest.mark.slow) for pair in ALL if pair in HEAVY]


@pytest.mark.parametrize("pairs", TOGETHER + ALONE)
def test_compiled_batched_and_differentiated(pairs):
    """jit = no jit; a batch of parts and of what comes in is a loop, without a second trace; gradients are finite.

    With respect to every parameter and every number that comes in. Two programs are compiled for several parts of a
    kind: the values with their gradients, and a batch of values.
    """
    arrays, rest = eqx.partition({pair: make(*pair) for pair in pairs}, eqx.is_inexact_array)
    traces = []

    def values(arrays, vs):
        return {pair: numbers(pair[0], part, vs[pair]) for pair, part in eqx.combine(arrays, rest).items()}

    def total(arrays, vs):
        traces.append(pairs)
        found = values(arrays, vs)
        return sum(one.sum() for one in found.values()), found

    use = eqx.filter_jit(jax.grad(total, argnums=(0, 1), has_aux=True))
    many, batch = jax.tree.map(lambda leaf: jnp.stack([leaf, 1.01 * leaf, leaf]), arrays), inputs(3)
    rows = [jax.tree.map(operator.itemgetter(i), many) for i in range(3)]
    each = lambda v: dict.fromkeys(pairs, v)
    found = [use(one, each(v)) for one, v in zip(rows, batch, strict=True)]
    _, other = use(jax.tree.map(moved, arrays), each(batch[0]))
    assert len(traces) == 1
    batched = eqx.filter_jit(eqx.filter_vmap(values))(many, each(batch))
    for pair in pairs:
        for gradients in ((of_parts[pair], of_numbers[pair]) for (of_parts, of_numbers), _ in found):
            assert all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree.leaves(gradients)), pair
        looped = np.stack([np.asarray(values[pair]) for _, values in found])
        assert looped.size and np.isfinite(looped).all(), pair
        if pair not in LONG:
            part = eqx.combine(arrays[pair], rest[pair])
            np.testing.assert_allclose(
                looped[0], plain(pair[0], part, batch[0]), rtol=1e-10, atol=1e-12, err_msg=str(pair)
            )
        np.testing.assert_allclose(np.asarray(batched[pair]), looped, rtol=1e-10, atol=1e-12, err_msg=str(pair))
        if jax.tree.leaves(arrays[pair]):
            assert (looped[0] != np.asarray(other[pair])).any(), f"the parameters of {pair} have no effect at all"


@pytest.mark.slow
def test_values_alone_compiled_and_batched(part):
    """Without gradients, and with one part for all that comes in; jit = no jit."""
    kind, thing = part
    batch = inputs(3)
    compiled = eqx.filter_jit(lambda thing, v: numbers(kind, thing, v))
    looped = np.stack([np.asarray(compiled(thing, v)) for v in batch])
    batched = np.asarray(
        eqx.filter_jit(eqx.filter_vmap(lambda thing, v: numbers(kind, thing, v), in_axes=(None, 0)))(thing, batch)
    )
    np.testing.assert_allclose(looped[0], plain(kind, thing, batch[0]), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(batched, looped, rtol=1e-10, atol=1e-12)


@pytest.mark.slow
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
