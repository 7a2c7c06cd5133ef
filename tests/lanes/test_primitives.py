"""What lanes make of JAX's primitives, against JAX itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.lanes.errors import Unsupported

ROWS = np.random.default_rng(6).normal(size=(11, 5))
MATRICES = np.random.default_rng(7).normal(size=(11, 3, 4))
WHERE = np.arange(11) - 3  # beyond both ends

OF_ROWS = {
    "sums": lambda x: (x.sum(), jnp.prod(x), x.max(), x.min(), (x > 0).all(), (x > 0).any()),
    "running": lambda x: (jnp.cumsum(x), jnp.cumprod(x), jax.lax.cummax(x), jax.lax.cumsum(x, reverse=True)),
    "places": lambda x: (jnp.argmax(x), jnp.argmin(x)),
    "moves": lambda x: (x[::-1], jnp.roll(x, 2), jnp.pad(x, (1, 2)), jnp.concatenate([x, x[:2]]), jnp.stack([x, x])),
    "rounding": lambda x: (jnp.floor(x), jnp.ceil(x), jnp.round(3 * x), jnp.sign(x), jnp.trunc(3 * x)),
    "whole": lambda x: ((10 * x).astype(int), (10 * x).astype(int) // 3, (10 * x).astype(int) % 3, x > 0),
    "choice": lambda x: jax.lax.cond(x[0] > 0, lambda: x, lambda: -2 * x),
    "switch": lambda x: jax.lax.switch((3 * jnp.abs(x[0])).astype(int), [lambda: x, lambda: -x, lambda: x * x]),
    "loop": lambda x: jax.lax.fori_loop(0, 4, lambda i, y: y * x + x[i], x),
    "scan": lambda x: jax.lax.scan(lambda total, entry: (total + entry, total * entry), 0.5, x),
    "backwards": lambda x: jax.lax.scan(lambda total, entry: (total + entry, total), 0.5, x, reverse=True),
    "interpolation": lambda x: jnp.interp(x, jnp.linspace(-1.0, 1.0, 6), jnp.arange(6.0) ** 2),
    "sought": lambda x: jnp.searchsorted(jnp.linspace(-2.0, 2.0, 9), x[0], side="right"),
    "clamped": lambda x: jnp.clip(x, x[0], x[0] + 1.0),
    "gradient": jax.grad(lambda x: (jnp.tanh(x) ** 2).sum()),
}


@pytest.mark.parametrize("name", OF_ROWS)
def test_of_rows(in_lanes, name):
    found, wanted = in_lanes(OF_ROWS[name])(ROWS), jax.vmap(OF_ROWS[name])(ROWS)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-15), found, wanted)


def halved(x):
    """Rounds that each lane needs its own number of."""
    return jax.lax.while_loop(lambda y: jnp.abs(y).max() > 0.01, lambda y: y / 2 + 1e-4 * x[0], x)


def work(x, rounds=40):
    """Enough that it is left out where no lane needs it."""
    return jax.lax.fori_loop(0, rounds, lambda i, y: jnp.sin(y) + x[i % 5] / 3, x)


LOOPS = {
    "while": halved,
    "counted": lambda x: jax.lax.fori_loop(0, (3 * jnp.abs(x[0])).astype(int), lambda i, y: y * x + 1, x),
    "long": lambda x: jax.lax.fori_loop(0, 1000, lambda i, y: 0.9 * y + x / (1 + i), x),
    "within": lambda x: jax.lax.fori_loop(0, (3 * jnp.abs(x[0])).astype(int), lambda i, y: halved(y + i), x),
    "branch": lambda x: jax.lax.cond(x[0] > 1.0, work, lambda x: -x, x),
    "branch_of_loop": lambda x: jax.lax.cond(x[0] > 0.0, halved, lambda x: -x, x),
    "branch_in_loop": lambda x: jax.lax.fori_loop(
        0, 100, lambda i, y: jax.lax.cond(y[0] > x[1], work, lambda y: y + 0.1, y), x
    ),
    "branches": lambda x: jax.lax.switch((2 * jnp.abs(x[0])).astype(int), [work, halved, lambda x: work(halved(x))], x),
    "of_what_stays": lambda x: jax.lax.cond(x[0] > 0.0, lambda: work(x), lambda: halved(x)),
    "nobody": lambda x: jax.lax.cond(x[0] > 100.0, lambda: (work(x), x[0]), lambda: (x, x[1])),
}


@pytest.mark.parametrize("lanes", [0, 1])
@pytest.mark.parametrize("name", LOOPS)
def test_loops_and_branches(in_lanes, name, lanes):
    found, wanted = in_lanes(LOOPS[name], lanes=lanes)(ROWS), jax.vmap(LOOPS[name])(ROWS)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14), found, wanted)


def test_a_loop_that_never_ends_elsewhere_does_not_hold_up_a_branch(in_lanes):
    """Where the branch is not taken the loop would not end; nobody waits for it."""

    def function(x):
        endless = lambda: jax.lax.while_loop(lambda y: y < 1.0, lambda y: y + jnp.maximum(x[0], 0.0), 0.0)
        return jax.lax.cond(x[0] > 0.1, endless, lambda: x[0])

    x = ROWS[:, 0]
    steps = np.ceil(1.0 / np.where(x > 0.1, x, 1.0))
    np.testing.assert_allclose(in_lanes(function)(ROWS), np.where(x > 0.1, steps * x, x), rtol=1e-12)


OF_MATRICES = {
    "products": lambda a: (a @ a.T, jnp.einsum("ij,kj->ik", a, a), a.T @ a[:, 0], jnp.trace(a[:, :3])),
    "batches": lambda a: jnp.einsum("ij,ij->i", a, a),
    "vmap": lambda a: jax.vmap(lambda row: row * row[0])(a),
    "transposed": lambda a: (a.T, a.reshape(4, 3), a[:, 1:3], jnp.outer(a[0], a[1])),
}


@pytest.mark.parametrize("name", OF_MATRICES)
def test_of_matrices(in_lanes, name):
    found, wanted = in_lanes(OF_MATRICES[name])(MATRICES), jax.vmap(OF_MATRICES[name])(MATRICES)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-15), found, wanted)


OF_PLACES = {
    "taken": lambda x, i: (x[i], jnp.take(x, i), jnp.take(x, jnp.stack([i, i + 1]), mode="clip"), x.at[i].get()),
    "filled": lambda x, i: x.at[i].get(mode="fill", fill_value=7.0),
    "window": lambda x, i: jax.lax.dynamic_slice(x, (i,), (2,)),
    "put": lambda x, i: (x.at[i].set(9.0), jax.lax.dynamic_update_slice(x, x[:2] * 2, (i,))),
    "put_row": lambda x, i: jnp.zeros((4, 5)).at[i].set(x),
    "one_hot": lambda x, i: jnp.where(jnp.arange(5) == i, x, 0.0),
}


@pytest.mark.parametrize("name", OF_PLACES)
def test_of_places_that_lanes_know(in_lanes, name):
    found, wanted = in_lanes(OF_PLACES[name])(ROWS, WHERE), jax.vmap(OF_PLACES[name])(ROWS, WHERE)
    jax.tree.map(np.testing.assert_array_equal, found, wanted)
    known = np.full(11, 2)
    found = in_lanes(OF_PLACES[name], constant=(1,))(ROWS, known)
    jax.tree.map(np.testing.assert_array_equal, found, jax.vmap(OF_PLACES[name])(ROWS, known))


RANDOM = {
    "bits": lambda key: jax.random.bits(key, (3,), jnp.uint32),
    "wide_bits": lambda key: jax.random.bits(key, (3,), jnp.uint64),
    "split": lambda key: jax.random.split(key, 3),
    "folded": lambda key: jax.random.fold_in(key, 77),
    "keys": lambda key: jax.vmap(lambda one: jax.random.bits(one, (2,)))(jax.random.split(key, 2)),
    "one": lambda key: jax.random.bits(key, (), jnp.uint32),
    "uniform": lambda key: jax.random.uniform(key, (4,), minval=-1.0, maxval=3.0),
}


@pytest.mark.parametrize("name", RANDOM)
def test_random_bits_are_those_of_jax(in_lanes, name):
    keys = np.stack([np.asarray(jax.random.PRNGKey(seed)) for seed in range(9)])
    found, wanted = in_lanes(RANDOM[name])(keys), jax.vmap(RANDOM[name])(keys)
    np.testing.assert_array_equal(found, wanted)


def test_normal_numbers(in_lanes):
    """JAX rounds x^2 before it takes it from 1, which far out costs it digits; in the middle they agree."""
    normal = lambda key: jax.random.normal(key, (5,))
    keys = np.stack([np.asarray(jax.random.PRNGKey(seed)) for seed in range(200)])
    found, wanted = in_lanes(normal)(keys), jax.vmap(normal)(keys)
    np.testing.assert_allclose(found, wanted, rtol=1e-11)
    middle = np.abs(wanted) < 1.0
    np.testing.assert_allclose(found[middle], wanted[middle], rtol=2e-14)


UNKNOWN = {
    "sort": jnp.sort,
    "a long scan": lambda x: jax.lax.scan(lambda total, entry: (total + entry, total), x[0], jnp.arange(100.0)),
    "eigenvalues": lambda x: jnp.linalg.eigvalsh(jnp.outer(x, x)),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_has_no_rule_is_said(in_lanes, name):
    with pytest.raises(Unsupported):
        in_lanes(UNKNOWN[name])(ROWS)
