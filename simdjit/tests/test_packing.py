"""Numbers of a single run side by side in a register: the same bits as run by run in lanes, and where it pays."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from programs import SIZE, number, program

from simdjit import Loop, packing
from simdjit.graph import F64, Graph
from simdjit.packing import find_packs, width_of
from simdjit.scalar import Scalar

pytestmark = pytest.mark.compiler

WIDTH = 8


def stepped(function, *rows, lanes):
    """Results of a function that is computed in a step, of operands that are carried, for every row."""
    example = tuple(jnp.asarray(row[0]) for row in rows)
    nothing = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), jax.eval_shape(function, *example))
    start = lambda numbers: (numbers, nothing)
    step = lambda numbers, carry, k: (carry[0], function(*carry[0]))
    program = Loop(lambda n: n, start, step, lambda n, carry, k: carry[1], example, lanes=lanes)
    (_, results), _ = program.run(rows, steps=1)
    return results


def same_bits(function, *rows):
    many, single = (jax.tree.leaves(stepped(function, *rows, lanes=lanes)) for lanes in (WIDTH, 1))
    for one, other in zip(many, single, strict=True):
        np.testing.assert_array_equal(one, other)
    return single


def angles(count):
    """Some of them so large that they are reduced by a loop of their own."""
    return np.random.default_rng(1).normal(size=(6, count)) * 10.0 ** np.arange(count)


@pytest.mark.parametrize("count", [1, 2, 5, 8, 19])
def test_functions_of_arrays(count):
    """A register filled, several of them, and one whose last lanes are idle."""
    x = angles(count)
    (found,) = same_bits(lambda x: jnp.sin(x) * jnp.exp(-jnp.abs(x)) + jnp.where(x > 1, x.sum(), x[::-1] / 3), x)
    expected = np.sin(x) * np.exp(-np.abs(x)) + np.where(x > 1, x.sum(1, keepdims=True), x[:, ::-1] / 3)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-15)


def test_numbers_of_every_kind():
    rng = np.random.default_rng(2)
    x, n = rng.normal(size=(5, 7)), rng.integers(-3, 4, size=(5, 7))

    def function(x, n):
        truths = (x > 0) ^ (n[::-1] > 0)
        return x.astype(int) // jnp.where(n == 0, 2, n), truths, truths.sum(), jnp.where(truths, n, -n) % 5, x[n[0]]

    quotient, truths, sums, rest, taken = same_bits(function, x, n)
    np.testing.assert_array_equal(quotient, x.astype(int) // np.where(n == 0, 2, n))
    np.testing.assert_array_equal(truths, (x > 0) ^ (n[:, ::-1] > 0))
    np.testing.assert_array_equal(sums, truths.sum(1))
    np.testing.assert_array_equal(rest, np.where(truths, n, -n) % 5)
    np.testing.assert_array_equal(taken, [row[places[0]] for row, places in zip(x, n, strict=True)])


def test_loops_and_branches():
    """Packs inside a loop, packs that a loop or a branch works on, and a branch of which one lane has no need."""
    x = angles(5)

    def function(x):
        halved = jax.lax.while_loop(lambda y: jnp.abs(y).max() > 2, lambda y: jnp.cos(y) * y / 2, x)
        branch = lambda y: jnp.tanh(jnp.stack([jnp.sin(y * i) for i in range(1, 30)])).sum(0)
        return halved, jax.lax.cond(x[0] > 0, branch, lambda y: y, jnp.sin(x) + halved)

    halved, _ = same_bits(function, x)
    assert (np.abs(halved) <= 2).all()


def test_packs_far_from_one_that_is_given_up_need_not_be_weighed_again(monkeypatch):
    """The same packs as by weighing all of them in every round, on random programs of rows that are alike in part."""

    def packs_of(seed):
        rng, graph = np.random.default_rng(seed), Graph()
        rows = [[graph.input(("carry", 4 * row + slot), F64) for slot in range(4)] for row in range(6)]
        for _ in range(200):
            name, places = str(rng.choice(["add", "mul", "sub"])), rng.integers(4, size=2)
            alike = rows if rng.random() < 0.95 else rows[: rng.integers(1, 6)]
            others = rows if rng.random() < 0.95 else rows[::-1]  # of the row itself, or of another one
            operands = [(row[places[0]], other[places[1]]) for row, other in zip(alike, others, strict=False)]
            target = rng.integers(4)
            for row, pair in zip(alike, operands, strict=True):
                row[target] = graph.apply(name, *pair)
        outputs = [node for row in rows for node in row]
        return set(find_packs(graph, outputs, [False] * len(graph.operations), WIDTH).groups.values())

    kept = [packs_of(seed) for seed in range(20)]
    assert sum(map(len, kept)) > 50
    monkeypatch.setattr(packing, "_taken", lambda due, part: True)
    assert [packs_of(seed) for seed in range(20)] == kept


def test_a_long_chain_inside_a_loop():
    """Of 1200 sums and squares, each made of the one before."""
    x = angles(3) % 1.0

    def body(y):
        for _ in range(600):
            y = y * y * 0.5 + 0.1
        return y

    (found,) = same_bits(lambda x: jax.lax.while_loop(lambda y: (y > 0.5).any(), body, x), x)
    assert (found <= 0.5).all()


def test_random_numbers():
    key = np.arange(8, dtype=np.uint32).reshape(4, 2)
    (found,) = same_bits(lambda key: jax.random.normal(key, (11,)), key)
    expected = [jax.random.normal(jnp.asarray(row), (11,)) for row in key]
    np.testing.assert_allclose(found, expected, rtol=1e-13)


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 100))])
def test_random_programs(seed):
    rng = np.random.default_rng(seed)
    one = program(rng, 20)
    given = [number(rng, dtype, (5, SIZE)) for dtype in one.inputs]
    for many, single in zip(
        *(stepped(lambda *rows: tuple(one(*rows)), *given, lanes=lanes) for lanes in (WIDTH, 1)), strict=True
    ):
        np.testing.assert_array_equal(many, single)


def packs(function, count):
    """Packs of what a function makes of so many carried numbers."""
    graph = Graph()
    given = [Scalar(graph, graph.input(("carry", i), F64)) for i in range(count)]
    outputs = [one.node for one in function(given)]
    return graph, set(find_packs(graph, outputs, [False] * len(graph.operations), WIDTH).groups.values())


def test_what_is_alike_is_packed():
    graph, made = packs(lambda given: [((x * 3.0 + float(i)) * x) / (x + 2.0) for i, x in enumerate(given)], 10)
    names = sorted((graph.operations[pack[0]].name, len(pack)) for pack in made)
    assert names == [("add", 8), ("add", 8), ("div", 8), ("mul", 8), ("mul", 8)], "the two left over are too few"


def test_what_costs_more_than_it_saves_is_not():
    """One product each: to bring operands together and results apart is more than that."""
    assert packs(lambda given: [x * y for x, y in zip(given[:3], given[3:], strict=True)], 6)[1] == set()


def test_sums_in_order_are_left_alone():
    """No sum is computed in another order than it is written."""
    graph, made = packs(lambda given: [sum((x * x * 2.0 for x in given[1:]), start=given[0])], 9)
    assert {graph.operations[pack[0]].name for pack in made} <= {"mul"}


def test_lanes_of_a_group():
    assert [width_of(tuple(range(count))) for count in (1, 2, 3, 4, 5, 8)] == [1, 2, 4, 4, 8, 8]
