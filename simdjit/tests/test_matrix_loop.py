"""Products of large matrices, which are loops over memory: the sums of NumPy, in the order of small ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emulated_gpu import EmulatedGpu

import simdjit
from simdjit import Driver, Loop, matrix_loop, nvidia

pytestmark = pytest.mark.compiler

RUNS = 11


def matrices(*shapes, dtype=float):
    chance = np.random.default_rng(7)
    return [(10 * chance.normal(size=(RUNS, *shape))).astype(dtype) for shape in shapes]


def in_order(one, other):
    """Every sum one product after another."""
    total = one[..., :, :1] * other[..., :1, :]
    for k in range(1, one.shape[-1]):
        total = total + one[..., :, k : k + 1] * other[..., k : k + 1, :]
    return total


@pytest.mark.parametrize("sides", [(16, 16, 16), (17, 19, 23), (5, 100, 12), (3, 40, 64), (1, 70, 60)])
@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int64])
def test_sums_in_order(in_lanes, sides, dtype):
    m, k, n = sides
    one, other = matrices((m, k), (k, n), dtype=dtype)
    np.testing.assert_array_equal(in_lanes(jnp.matmul)(one, other), in_order(one, other))


def test_a_loop_is_used_and_has_the_bits_of_what_is_written_out(monkeypatch, tmp_path):
    one, other = matrices((20, 20), (20, 20))
    asked = []
    compiled = lambda folder: simdjit.compile(jnp.matmul, one[0], other[0], cache=tmp_path / folder)
    product = matrix_loop.product
    monkeypatch.setattr("simdjit.reductions.product", lambda *given: asked.append(given) or product(*given))
    found = compiled("loop")(one, other)
    assert len(asked) == 1
    monkeypatch.setattr("simdjit.reductions.FROM", 10**9)
    np.testing.assert_array_equal(compiled("written out")(one, other), found)
    assert len(asked) == 1


@pytest.mark.parametrize("constant", [(), (0,), (1,), (0, 1)])
@pytest.mark.parametrize("lanes", [0, 1])
def test_turned_and_several_in_a_row(in_lanes, constant, lanes):
    """Results of a product are used where they lie, also turned, and constants lie among the program's."""
    one, other = (np.broadcast_to(x[:1], x.shape) for x in matrices((18, 18), (18, 18)))
    found = in_lanes(lambda a, b: ((a @ b) @ a.T).T @ b + a.T @ b, constant, lanes)(one, other)
    turned = one.swapaxes(1, 2)
    expected = in_order(in_order(in_order(one, other), turned).swapaxes(1, 2), other) + in_order(turned, other)
    np.testing.assert_array_equal(found, expected)


def test_stacks_of_matrices(in_lanes):
    one, other = matrices((3, 16, 17), (3, 17, 16))
    np.testing.assert_array_equal(in_lanes(jnp.matmul)(one, other), in_order(one, other))


def test_within_loops_and_branches(in_lanes):
    """A loop whose end each lane knows, with a product inside and another in a branch."""
    (one,) = matrices((16, 16))
    one, count = one / 100, np.arange(RUNS)

    def function(a, count):
        grown = jax.lax.while_loop(lambda c: c[1] < count, lambda c: (c[0] @ a, c[1] + 1), (a, 0))[0]
        return jax.lax.cond(count % 2 == 0, lambda x: x @ x, lambda x: x, grown)

    found, expected = in_lanes(function)(one, count), one.copy()
    for run in range(RUNS):
        for _ in range(run):
            expected[run] = in_order(expected[run], one[run])
        if run % 2 == 0:
            expected[run] = in_order(expected[run], expected[run])
    np.testing.assert_array_equal(found, expected)


def test_the_sign_of_zero(in_lanes):
    zeros = np.full((RUNS, 16, 16), -0.0)
    found = in_lanes(jnp.matmul)(zeros, np.ones_like(zeros))
    assert np.signbit(found).all()


def test_a_filter_of_many_states_on_a_gpu(monkeypatch):
    """The covariance of a Kalman filter with 16 states, from the carry of every step; the bits of vectors."""
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, *rest: assembly)
    chance = np.random.default_rng(3)
    moves, noise = chance.normal(size=(2, 40, 16, 16)) / 4
    parts = (
        lambda numbers: numbers,
        lambda numbers: numbers[1],
        lambda numbers, carry, k: numbers[0] @ carry @ numbers[0].T + numbers[1],
        lambda numbers, carry, k: jnp.trace(carry),
    )
    programs = (Loop(*parts, (moves[0], noise[0]), driver=driver) for driver in (Driver(EmulatedGpu()), None))
    found, expected = (program.run((moves, noise), 5, 1) for program in programs)
    jax.tree.map(np.testing.assert_array_equal, found, expected)
    covariance = noise
    for _ in range(5):
        covariance = in_order(in_order(moves, covariance), moves.swapaxes(1, 2)) + noise
    np.testing.assert_array_equal(found[0], covariance)
