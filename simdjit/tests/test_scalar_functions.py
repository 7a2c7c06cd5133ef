"""What programs of lanes compute against closed forms, and the same bits however hard LLVM tries."""

import threading
import time

import jax.numpy as jnp
import numpy as np
import pytest

import simdjit
from simdjit import cpu

pytestmark = pytest.mark.quick


def swing(x, rate):
    """Functions, sums in order, choices and a matrix, all of one run."""
    angles = jnp.arctan2(jnp.sin(x), jnp.cos(x))
    decay = jnp.exp(-rate * jnp.abs(x))
    return {
        "angles": angles,
        "decay": decay,
        "sum": (decay * angles).sum(),
        "turned": jnp.outer(x, angles) @ decay,
        "chosen": jnp.where(x > 0, jnp.sqrt(jnp.abs(x)), jnp.cbrt(x)),
        "positive": (x > 0).sum(),
    }


@pytest.fixture(scope="module")
def runs():
    """More runs than there are lanes, the last group not full; the angles are within half a turn."""
    rng = np.random.default_rng(4)
    return rng.uniform(-3.0, 3.0, (21, 3)), rng.uniform(0.1, 2.0, 21)


def test_a_function_against_numpy(runs):
    x, rate = runs
    found = simdjit.compile(swing, x[0], rate[0])(x, rate)
    decay = np.exp(-rate[:, None] * np.abs(x))
    wanted = {
        "angles": x,
        "decay": decay,
        "sum": (decay * x).sum(1),
        "turned": x * (x * decay).sum(1, keepdims=True),
        "chosen": np.where(x > 0, np.sqrt(np.abs(x)), np.cbrt(x)),
    }
    for name, expected in wanted.items():
        np.testing.assert_allclose(found[name], expected, rtol=1e-13, atol=1e-14, err_msg=name)
    np.testing.assert_array_equal(found["positive"], (x > 0).sum(1))


def test_a_loop_is_a_geometric_sequence():
    """x(k) = a^k x(0) + k b: powers of two, so that no operation rounds."""
    loop = simdjit.Loop(
        lambda numbers: numbers,
        lambda numbers: (numbers[0], jnp.zeros_like(numbers[0])),
        lambda numbers, carry, k: (carry[0] * numbers[1], carry[1] + 0.25 * k.astype(float)),
        lambda numbers, carry, k: carry[0] + carry[1],
        (np.zeros(()), np.zeros(())),
    )
    start, ratio = np.arange(1.0, 14.0), np.resize([0.5, 2.0, -1.0], 13)
    (power, total), seen = loop.run((start, ratio), steps=8, every=4)
    np.testing.assert_array_equal(power, start * ratio**8)
    np.testing.assert_array_equal(total, np.full(13, 0.25 * 28))
    at = np.array([0, 4, 8])
    np.testing.assert_array_equal(seen, start[:, None] * ratio[:, None] ** at + 0.125 * at * (at - 1))


def test_a_loop_may_be_compiled_quickly(tmp_path, monkeypatch):
    """With the same bits; each has machine code of its own, also where it is written and read."""
    monkeypatch.delenv("SIMDJIT_OPTIMIZATION", raising=False)
    known = lambda numbers: numbers
    step = lambda rates, angles, k: angles + 0.1 * jnp.sin(rates * angles)
    finals = []
    for optimize in (True, False):
        functions = known, lambda rates: 2 * rates, step, lambda rates, angles, k: angles
        loop = simdjit.Loop(*functions, np.zeros(5), lanes=1, cache=tmp_path, portable=True, optimize=optimize)
        for each in (loop, simdjit.Loop.read(loop.written(), tmp_path)):
            final, _ = each.run(np.linspace(-2.0, 2.0, 10).reshape(2, 5), steps=20)
            finals.append(np.asarray(final).tobytes())
    assert len(set(finals)) == 1
    assert len(list(tmp_path.rglob("*.o"))) == 2


def test_a_loop_that_is_run_often_is_compiled_thoroughly(tmp_path, monkeypatch):
    """By a thread, once, while the brief code goes on; results have the same bits before and after."""
    monkeypatch.delenv("SIMDJIT_OPTIMIZATION", raising=False)
    known = lambda numbers: numbers
    step = lambda rates, angles, k: angles + 0.1 * jnp.sin(rates * angles)
    functions = known, lambda rates: 2 * rates, step, lambda rates, angles, k: angles
    loop = simdjit.Loop(*functions, np.zeros(5), lanes=1, cache=tmp_path, optimize="later")
    made = lambda: len(list(tmp_path.rglob("*.o")))
    finals, before = [], threading.active_count()
    for _ in range(7):
        finals.append(loop.run(np.linspace(-2.0, 2.0, 5)[None], steps=20)[0].tobytes())
    assert made() == 1 and threading.active_count() == before
    monkeypatch.setattr(cpu, "_LONG", 0.0)  # s
    for _ in range(20):
        finals.append(loop.run(np.linspace(-2.0, 2.0, 5)[None], steps=20)[0].tobytes())
        time.sleep(0.02)
    while threading.active_count() > before:
        time.sleep(0.01)
    finals.append(loop.run(np.linspace(-2.0, 2.0, 5)[None], steps=20)[0].tobytes())
    assert made() == 2 and len(set(finals)) == 1


def test_without_optimization_the_bits_are_the_same(runs, tmp_path, monkeypatch):
    """Each level has machine code of its own in the cache, and the numbers differ in no bit."""
    x, rate = runs
    found, code = [], []
    monkeypatch.setenv("SIMDJIT_CACHE", str(tmp_path))
    for level in ("0", None):
        if level is None:
            monkeypatch.delenv("SIMDJIT_OPTIMIZATION", raising=False)
        else:
            monkeypatch.setenv("SIMDJIT_OPTIMIZATION", level)
        found.append(simdjit.compile(swing, x[0], rate[0])(x, rate))
        code.append({file.read_bytes() for file in tmp_path.rglob("*.o")})
    for name, expected in found[0].items():
        assert found[1][name].tobytes() == expected.tobytes(), name
    assert len(code[0]) == 1 and len(code[1]) == 2
