"""Random programs in lanes against `jax.jit`, step by step: the same numbers, and the same of what is no number."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from programs import LARGE, SIZE, STEPS, number, program

from simdjit.graph import Graph, flat
from simdjit.lowering import evaluate, nodes_of
from simdjit.prologue import inputs

pytestmark = pytest.mark.compiler

ROWS = 16


@functools.cache
def by_jax(name):
    return jax.jit(jax.vmap(STEPS[name].function))


def reference(name, operands):
    step = STEPS[name]
    operands = [np.where(x != x, x.dtype.type(np.nan), x) if x.dtype.kind == "f" else x for x in operands]  # no -NaN
    with np.errstate(all="ignore"):
        if step.exact is None:
            return np.asarray(by_jax(name)(*operands))
        result = step.exact(*(x.astype(np.longdouble) for x in operands))
        return result.astype(operands[0].dtype)


def flushed(x):
    """JAX takes numbers below the ordinary ones for zero; lanes keep them."""
    return np.where(np.abs(x) < np.finfo(x.dtype).tiny, 0, x) if x.dtype.kind == "f" else x


def subnormal(x):
    return x.dtype.kind == "f" and ((flushed(x) == 0) & (x != 0)).any(axis=-1)


def check(name, operands, found):
    step, wanted = STEPS[name], reference(name, operands)
    assert found.dtype == wanted.dtype and found.shape == wanted.shape
    compared = ~np.any([np.broadcast_to(subnormal(x), len(found)) for x in operands], axis=0)
    if name in LARGE:
        compared &= ~np.any(
            [(np.abs(x) > np.finfo(x.dtype).max / 1e9).any(axis=-1) for x in operands if x.dtype.kind == "f"], axis=0
        )
    found, wanted, operands = flushed(found)[compared], flushed(wanted)[compared], [x[compared] for x in operands]
    same = (found == wanted) | (found != found) & (wanted != wanted)
    if step.units:
        with np.errstate(all="ignore"):
            size = step.scale(*operands) if step.scale else np.abs(wanted)
            # A result that flushes to zero, or is the largest number and no more, may do so a little earlier or later.
            limits = np.finfo(found.dtype)
            room = step.units * np.maximum(limits.eps * size, limits.tiny)
            same |= np.abs(found.astype("float64") - wanted.astype("float64")) <= room
    wrong = np.argwhere(~same)
    if len(wrong):
        row, place = wrong[0]
        given = [x[row] for x in operands]
        raise AssertionError(f"{name} of {given} gave {found[row]!r} instead of {wanted[row]!r} (entry {place})")


def bits(values):
    """Bits, but for what is no number and the sign of a zero."""
    values = np.asarray(values)
    if values.dtype.kind != "f":
        return values
    tidy = np.where(values != values, np.nan, np.where(values == 0, 0, values)).astype(values.dtype)
    return tidy.view(f"u{values.dtype.itemsize}")


def with_zeros(one):
    """Whether something in a program is found to be zero at once; its product with no number is then no longer none."""
    graph = Graph()
    traced = jax.make_jaxpr(lambda *rows: one(*rows))(*(jax.ShapeDtypeStruct((SIZE,), dtype) for dtype in one.inputs))
    found = flat(evaluate(graph, traced, inputs(graph, "number", traced.in_avals)))
    return any(graph.types[node].startswith("float") and graph.value(node) == 0 for node in found)


def examine(in_lanes, seed, length):
    rng = np.random.default_rng(seed)
    one = next(one for one in iter(lambda: program(rng, length), None) if not with_zeros(one))
    given = [number(rng, dtype, (ROWS, SIZE)) for dtype in one.inputs]
    found = in_lanes(lambda *rows: one(*rows))(*given)
    values = [*given, *(np.broadcast_to(x, (ROWS, SIZE)) for x in one.constants), *found]
    for (name, places), result in zip(one.steps, found, strict=True):
        check(name, [values[place] for place in places], result)
    alone = in_lanes(lambda *rows: one(*rows), lanes=1)(*given)
    for (name, _), many, single in zip(one.steps, found, alone, strict=True):
        np.testing.assert_array_equal(bits(many), bits(single), err_msg=f"{name}, in lanes and in one")
    traced = jax.make_jaxpr(lambda *rows: one(*rows))(*(jnp.asarray(x[0]) for x in given))
    for row in range(0, ROWS, 5):
        graph = Graph()
        folded = evaluate(graph, traced, [nodes_of(graph, x[row]) for x in given])
        for (name, places), many, nodes in zip(one.steps, found, folded, strict=True):
            known = [graph.value(node) for node in nodes.ravel().tolist()]
            pairs = [(value, other) for value, other in zip(known, many[row], strict=True) if value is not None]
            for value, other in pairs:
                operands = [values[place][row] for place in places]
                assert bits(value) == bits(other), f"{name} of {operands}: {value} as a constant, else {other}"
            if any(
                value == 0 and np.signbit(value) != np.signbit(other)
                for value, other in pairs
                if value.dtype.kind == "f"
            ):
                break  # the sign of a zero is not kept, and what is divided by it differs from here on


@pytest.mark.parametrize("seed", range(5))
def test_random_programs(in_lanes, seed):
    examine(in_lanes, seed, 20)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1000, 1400))
def test_many_random_programs(in_lanes, seed):
    examine(in_lanes, seed, 40)


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPS)
def test_every_step_by_itself(in_lanes, name):
    """Of all kinds of operands, many numbers."""
    rng = np.random.default_rng(7)
    kinds = {"f": ("float64", "float32"), "i": ("int32", "int64", "uint32"), "b": ("bool",)}
    for i in range(max(len(kinds[kind]) for kind in STEPS[name].kinds)):
        types = [kinds[kind][i % len(kinds[kind])] for kind in STEPS[name].kinds]
        given = [number(rng, dtype, (2000, SIZE)) for dtype in types]
        check(name, given, in_lanes(STEPS[name].function)(*given))
