"""What lanes make of JAX's primitives, against JAX itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from simdjit import Unsupported
from simdjit.graph import Graph
from simdjit.lowering import nodes_of
from simdjit.rules import Equation, results

pytestmark = pytest.mark.compiler

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


def work(x, rounds=8):
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


def recalled(x, k):
    """Entries of long tables that lie in memory: built in, brought along, made from them, and of truths."""
    table = np.cos(np.arange(300.0))
    square = jnp.outer(x[:30], x[:20])
    return (
        jnp.asarray(table)[k],
        x[k],
        (2 * x)[k],
        (x > 0)[k],
        jax.lax.dynamic_slice(x, (k,), (3,)),
        square[k % 30, k % 20],
        jnp.interp(x[0], jnp.arange(300.0) / 100, table),
        jax.vmap(lambda row, i: row[i])(x.reshape(3, 100), jnp.stack([k, k + 1, k + 2]) % 100),
    )


@pytest.mark.parametrize("lanes", [0, 1])
def test_long_tables(in_lanes, lanes):
    x, k = np.random.default_rng(8).normal(size=(11, 300)), np.arange(11) * 31 - 20  # beyond both ends
    found, wanted = in_lanes(recalled, lanes=lanes)(x, k), jax.vmap(recalled)(x, k)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-15), found, wanted)


@pytest.mark.parametrize("size", [1, 2, 6, 12])
def test_small_systems_of_equations(in_lanes, size):
    """What solves is multiplied back; a singular matrix has determinant 0 and no Cholesky factor."""
    rng = np.random.default_rng(size)
    matrices, right = rng.normal(size=(9, size, size)), rng.normal(size=(9, size, 2))
    matrices[-1] = 1.0 if size > 1 else 0.0
    definite = matrices @ matrices.transpose(0, 2, 1) + np.eye(size)
    solved = in_lanes(jnp.linalg.solve)(matrices[:-1], right[:-1])
    np.testing.assert_allclose(matrices[:-1] @ solved, right[:-1], atol=1e-10)
    np.testing.assert_allclose(in_lanes(jnp.linalg.det)(matrices), np.linalg.det(matrices), rtol=1e-10, atol=1e-12)
    inverse = in_lanes(jnp.linalg.inv)(matrices[:-1])
    np.testing.assert_allclose(inverse @ matrices[:-1], np.broadcast_to(np.eye(size), inverse.shape), atol=1e-9)
    factor = in_lanes(jnp.linalg.cholesky)(definite)
    np.testing.assert_allclose(factor @ factor.transpose(0, 2, 1), definite, rtol=1e-12, atol=1e-12)
    assert np.isnan(in_lanes(jnp.linalg.cholesky)(-definite)[:, -1, -1]).all()
    for lower, trans in ((True, 0), (True, 1), (False, 0), (False, 1)):
        triangle = np.tril(definite) if lower else np.triu(definite)
        one = lambda a, b, lower=lower, trans=trans: jax.scipy.linalg.solve_triangular(a, b, lower=lower, trans=trans)
        found = in_lanes(one)(triangle, right)
        np.testing.assert_allclose((triangle.transpose(0, 2, 1) if trans else triangle) @ found, right, atol=1e-9)


@pytest.mark.parametrize("size", [1, 2, 5, 8, 13, 33])
def test_order_of_few_numbers(in_lanes, size):
    """Equal ones stay in their order, and what is no number comes last."""
    rows = np.random.default_rng(size).integers(-3, 4, (40, size)).astype(float)
    rows[3:6, size // 2] = [np.nan, np.inf, -0.0]
    np.testing.assert_array_equal(in_lanes(jnp.sort)(rows), np.sort(rows))
    np.testing.assert_array_equal(in_lanes(jnp.argsort)(rows), np.argsort(rows, kind="stable"))
    np.testing.assert_array_equal(in_lanes(lambda x: -jnp.sort(-x))(rows[6:]), -np.sort(-rows[6:]))


OF_SETTING = {
    "added": lambda x, i: x.at[i].add(1.5),
    "added_twice": lambda x, i: x.at[jnp.stack([i, i, i + 1])].add(x[:3]),
    "multiplied": lambda x, i: x.at[i].multiply(-2.0),
    "largest": lambda x, i: x.at[i].max(0.1).at[i + 1].min(-0.1),
    "padded": lambda x, i: (jax.lax.pad(x, 7.0, [(-2, 3, 0)]), jax.lax.pad(x, 7.0, [(1, -3, 2)])),
}


@pytest.mark.parametrize("name", OF_SETTING)
def test_entries_changed_where_they_stand(in_lanes, name):
    found, wanted = in_lanes(OF_SETTING[name])(ROWS, WHERE), jax.vmap(OF_SETTING[name])(ROWS, WHERE)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-15), found, wanted)


@pytest.mark.parametrize("constant", [(), (0,), (1,), (0, 1)])
def test_whole_numbers_divided_by_nothing(in_lanes, constant):
    """A processor stops there; XLA does not."""
    least = np.iinfo(np.int64).min
    pairs = [(7, 0), (-7, 0), (least, -1), (least, 0), (7, -1), (7, 2), (-7, 2), (-7, -2), (0, 0)]
    both = lambda a, b: (jax.lax.div(a, b), jax.lax.rem(a, b), a // b, a % b, jnp.where(b == 0, 0, 7 // b))
    for a, b in pairs:
        rows = np.array([a, a]), np.array([b, b])
        jax.tree.map(np.testing.assert_array_equal, in_lanes(both, constant=constant)(*rows), jax.vmap(both)(*rows))
    rows = np.array([12, 0, 7, -8]), np.array([18, 0, 0, 12])
    np.testing.assert_array_equal(in_lanes(jnp.gcd)(*rows), [6, 0, 7, 4])


@pytest.mark.parametrize("dtype", ["int32", "int64", "uint32", "uint64"])
def test_shifts_and_conversions_beyond_the_last_bit(in_lanes, dtype):
    by = np.array([0, 1, 31, 32, 33, 63, 64, 65], dtype=dtype)
    x = np.full(8, 0xF0000005, dtype=np.int64).astype(dtype)
    for shift in (jax.lax.shift_left, jax.lax.shift_right_logical, jax.lax.shift_right_arithmetic):
        np.testing.assert_array_equal(in_lanes(shift)(x, by), jax.vmap(shift)(x, by))
    far = np.array([np.nan, np.inf, -np.inf, 1e20, -1e20, -1.5, 3e9, -0.5])
    to = lambda x: x.astype(dtype)
    wanted = jax.vmap(to)(far)
    np.testing.assert_array_equal(in_lanes(to)(far), wanted)
    alone = [in_lanes(to, constant=(0,))(np.array([value, value]))[0] for value in far]
    np.testing.assert_array_equal(alone, wanted)


@pytest.mark.parametrize("constant", [(), (0,)])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_what_is_no_number_has_no_sign(in_lanes, dtype, constant):
    """Which sign an instruction gives it is left open: it must not come through, whether folded or computed."""
    whole = dtype.replace("float", "int")
    read = lambda x: (jnp.signbit(x), jnp.copysign(2, x), jax.lax.bitcast_convert_type(x, whole))
    numbers = np.array([np.nan, -3.0], dtype)
    for nan in (np.nan, -np.nan):
        given = np.array([[nan, -3.0]] * 2, dtype)
        for lanes in (0, 1):
            found = in_lanes(read, constant=constant, lanes=lanes)(given)
            for one, wanted in zip(found, ([False, True], [2, -2], numbers.view(whole)), strict=True):
                np.testing.assert_array_equal(one, [wanted] * 2)


def test_the_first_that_is_no_number_is_extreme(in_lanes):
    rows = np.array([[1.0, np.nan, 3.0, np.nan, 5.0], [2.0, 1.0, 2.0, 0.0, 0.0]])
    np.testing.assert_array_equal(in_lanes(jnp.argmax)(rows), [1, 0])
    np.testing.assert_array_equal(in_lanes(jnp.argmin)(rows), [1, 3])


def test_products_and_extremes_of_nothing(in_lanes):
    def function(x):
        none = x[:0]
        return none @ none, jnp.zeros((2, 0)) @ jnp.zeros((0, 3)), none.sum(), jnp.prod(none), none.max(initial=-1.0)

    jax.tree.map(np.testing.assert_array_equal, in_lanes(function)(ROWS), jax.vmap(function)(ROWS))


def test_a_long_loop_over_rows(in_lanes):
    """Rows are taken from memory, forwards and backwards."""
    rows = np.random.default_rng(1).normal(size=(7, 90, 2))
    for reverse in (False, True):
        fold = lambda x, reverse=reverse: jax.lax.scan(lambda c, r: (0.9 * c + r, None), x[0], x, reverse=reverse)[0]
        np.testing.assert_allclose(in_lanes(fold)(rows), jax.vmap(fold)(rows), rtol=1e-12)


def typed(key):
    """Keys that JAX knows for keys, split, chosen, stacked and folded."""
    one, *others = jax.random.split(jax.random.wrap_key_data(key), 3)
    stacked = jnp.stack(others)[::-1].reshape(1, 2)[0, 1]
    chosen = jnp.where(jax.random.bernoulli(one), one, stacked)
    return jnp.stack([jax.random.bits(each, (2,)) for each in (one, stacked, chosen, jax.random.fold_in(one, 5))])


RANDOM = {
    "typed": typed,
    "bits": lambda key: jax.random.bits(key, (3,), jnp.uint32),
    "wide_bits": lambda key: jax.random.bits(key, (3,), jnp.uint64),
    "split": lambda key: jax.random.split(key, 3),
    "folded": lambda key: jax.random.fold_in(key, 77),
    "keys": lambda key: jax.vmap(lambda one: jax.random.bits(one, (2,)))(jax.random.split(key, 2)),
    "one": lambda key: jax.random.bits(key, (), jnp.uint32),
    "uniform": lambda key: jax.random.uniform(key, (4,), minval=-1.0, maxval=3.0),
    "whole": lambda key: jax.random.randint(key, (4,), -3, 11),
    "choice": lambda key: jax.random.choice(key, jnp.arange(5.0), (3,)),
    "permutation": lambda key: jax.random.permutation(key, jnp.arange(6)),
    "seeded": lambda key: jax.random.bits(jax.random.key(key[1].astype(int) - 7), (2,)),
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
    "int8": (lambda x: x.astype(jnp.int8), "numbers of type int8"),
    "uint8": (lambda x: x.astype(jnp.uint8), "numbers of type uint8"),
    "float16": (lambda x: x.astype(jnp.float16) * 2, "numbers of type float16"),
    "complex": (lambda x: jnp.abs(jax.lax.complex(x, x)), "no rule for `complex`"),
    "a long scan": (
        lambda x: jax.lax.scan(lambda total, entry: (total + entry, total), x[0], jnp.arange(100.0)),
        "what is kept of a scan of 100 rounds",
    ),
    "eigenvalues": (lambda x: jnp.linalg.eigvalsh(jnp.outer(x, x)), "no rule for `eigh`"),
    "long sort": (lambda x: jnp.sort(jnp.concatenate([x] * 20)), "sorting of 100 numbers, more than 64"),
    "large solve": (lambda x: jnp.linalg.inv(jnp.eye(24) * x[0]), "a matrix of 24 by 24, more than 20"),
    "accuracy": (lambda x: jax.lax.exp(x, accuracy=jax.lax.AccuracyMode.HIGHEST), "no rule for `exp` with accuracy"),
    "printed": (lambda x: (jax.debug.print("{}", x[0]), x)[1], "no rule for `debug_"),
    "called back": (
        lambda x: jax.pure_callback(np.sin, jax.ShapeDtypeStruct((5,), x.dtype), x),
        "no rule for `pure_callback`",
    ),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_has_no_rule_is_said(in_lanes, name):
    function, why = UNKNOWN[name]
    with pytest.raises(Unsupported, match=why) as said:
        in_lanes(function)(ROWS)
    assert said.value.__cause__ is None, "known not to be supported, not found out by an error"


def test_parameters_that_no_rule_knows_are_not_passed_over():
    """Every rule says which parameters it knows; a new one, or a rule that errs, is left to XLA."""
    graph = Graph()
    x = nodes_of(graph, 1.5)
    asked = lambda **params: Equation(graph, params, [jax.ShapeDtypeStruct((), np.dtype("float64"))], lambda *_: [])
    assert graph.value(int(results("floor", asked(accuracy=None), [x])[0])) == 1.0
    with pytest.raises(Unsupported, match="no rule for `floor` with towards 0"):
        results("floor", asked(towards=0), [x])
    with pytest.raises(Unsupported, match="no rule for `flor`"):
        results("flor", asked(), [x])
    with pytest.raises(Unsupported, match=r"the rule for `integer_pow` failed \(KeyError: 'y'\)"):
        results("integer_pow", asked(), [x])
    with pytest.raises(Unsupported, match="the rule for `lt` gave something else"):
        results("lt", asked(), [x, x])
