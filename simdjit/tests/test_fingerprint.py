"""A program is found by what JAX traced: equal functions have one, and any that differ have different ones."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simdjit.loop
from simdjit import Loop
from simdjit.fingerprint import fingerprint

pytestmark = pytest.mark.compiler

X, K = np.linspace(0.1, 0.9, 3), np.arange(3)


def shifted(by):
    return lambda x, k: x + by


def through(inner):
    return lambda x, k: jax.jit(inner)(x)


# Pairs of neighbours differ in one thing each: a literal, a constant, its type, an operand, a parameter, what is called.
FUNCTIONS = {
    "plus 1": lambda x, k: x + 1.0,
    "plus 2": lambda x, k: x + 2.0,
    "minus 1": lambda x, k: x - 1.0,
    "constant": shifted(np.array([1.0, 2.0, 3.0])),
    "another constant": shifted(np.array([1.0, 2.0, 4.0])),
    "x - k": lambda x, k: x - k.astype(x.dtype),
    "k - x": lambda x, k: k.astype(x.dtype) - x,
    "sum of rows": lambda x, k: jnp.outer(x, x[:2]).sum(axis=0),
    "sum of columns": lambda x, k: jnp.outer(x[:2], x).sum(axis=1),
    "power 3": lambda x, k: jax.lax.integer_pow(x, 3),
    "power 4": lambda x, k: jax.lax.integer_pow(x, 4),
    "taken, clipped": lambda x, k: x.at[k].get(mode="clip"),
    "taken, filled": lambda x, k: x.at[k].get(mode="fill", fill_value=0.0),
    "inner sine": through(jnp.sin),
    "inner cosine": through(jnp.cos),
    "three rounds": lambda x, k: jax.lax.fori_loop(0, 3, lambda i, y: 2 * y, x),
    "four rounds": lambda x, k: jax.lax.fori_loop(0, 4, lambda i, y: 2 * y, x),
    "one of two": lambda x, k: jax.lax.cond(k[0] > 0, lambda y: y + 1, lambda y: y - 1, x),
    "one of two, exchanged": lambda x, k: jax.lax.cond(k[0] > 0, lambda y: y - 1, lambda y: y + 1, x),
    "two results": lambda x, k: (x, 2 * x),
    "two results, exchanged": lambda x, k: (2 * x, x),
    "random": lambda x, k: jax.random.normal(jax.random.key(0), (3,)),
    "random of another key": lambda x, k: jax.random.normal(jax.random.key(1), (3,)),
}


def name(function, *arguments):
    return fingerprint([jax.make_jaxpr(function)(*arguments)])


def test_equal_functions_have_one_name_and_others_differ():
    names = {key: name(function, X, K) for key, function in FUNCTIONS.items()}
    jax.clear_caches()
    assert names == {key: name(function, X, K) for key, function in FUNCTIONS.items()}
    assert None not in names.values()
    assert [pair for pair in itertools.combinations(names, 2) if names[pair[0]] == names[pair[1]]] == []


def test_shapes_types_and_whatever_else_count():
    double = lambda x: 2 * x
    several = [X, X[:2], X.astype("float32"), K]
    closed = [jax.make_jaxpr(double)(x) for x in several]
    further = [(), (8,), (True,), (np.array(8),), (None, X), (X, None), ((X,), None), ("8",)]
    names = [fingerprint([closed[0]], *more) for more in further] + [fingerprint([one]) for one in closed[1:]]
    assert len(set(names)) == len(names) and None not in names
    with jax.threefry_partitionable(False):  # which other random numbers come from
        assert fingerprint([closed[0]]) not in names


def test_names_and_hints_do_not_count():
    def one(x):
        return jnp.sin(x)

    def other(x):
        return jnp.sin(x)

    assert name(jax.jit(one), X) == name(jax.jit(other, inline=False, donate_argnums=()), X)


def test_what_has_no_rule_has_no_name():
    assert name(jnp.fft.fft, X) is None
    assert name(functools.partial(jax.pure_callback, lambda x: x, X), X) is None


def long(x):
    """Of more operations than a program computes before its first step."""
    return jnp.sin(jnp.outer(jnp.arange(1.0, 601.0), x)).sum(axis=0)


@pytest.mark.parametrize("prologue", [jnp.sin, long], ids=["own", "by XLA"])
def test_a_known_program_is_not_lowered_again(monkeypatch, tmp_path, prologue):
    def made(step=2.0):
        return Loop(
            lambda x: prologue(x),
            lambda known: known,
            lambda known, carry, k: carry + step * known,
            lambda known, carry, k: carry,
            X,
            cache=tmp_path / "cache",
        )

    rows = np.stack([X, X**2])
    first = made()
    wanted = first.run(rows, steps=5, every=1)

    def refused(*arguments, **options):
        raise AssertionError("lowered again")

    monkeypatch.setattr(simdjit.loop, "evaluate", refused)
    again = made()
    assert again.operations == first.operations > 0
    for found, known in zip(again.run(rows, steps=5, every=1), wanted, strict=True):
        np.testing.assert_array_equal(found, known)
    with pytest.raises(AssertionError, match="lowered again"):
        made(step=3.0)


def test_a_name_that_cannot_be_is_no_obstacle(monkeypatch, tmp_path):
    monkeypatch.setattr(simdjit.loop, "fingerprint", lambda *given: None)
    loop = Loop(
        lambda x: x, lambda x: x, lambda x, y, k: y * 2, lambda x, y, k: y, np.ones(()), cache=tmp_path / "cache"
    )
    assert loop.run(np.ones(3), steps=4)[0].tolist() == [16.0] * 3
    assert [path.suffix for path in (tmp_path / "cache").iterdir()] == [".o"]
