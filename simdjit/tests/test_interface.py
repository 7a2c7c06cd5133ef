"""The public face: a function and a loop of one run for batches, against JAX; and a package that stands by itself."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simdjit

pytestmark = pytest.mark.compiler

PROJECT = Path(__file__).parents[1]


def damped(x, p):
    """A tree in, a tree out."""
    y = jnp.exp(-p["rate"] * x) * jnp.cos(x)
    return {"value": y, "count": (y > 0).sum()}


def batch(runs):
    rng = np.random.default_rng(runs)
    return rng.normal(size=(runs, 3)), {"rate": rng.uniform(0.1, 2.0, size=runs)}


@pytest.mark.parametrize("runs", [1, 8, 21])
def test_a_function_for_a_batch(runs):
    x, p = batch(runs)
    compiled = simdjit.compile(damped, x[0], {"rate": np.zeros(())})
    found, wanted = compiled(x, p), jax.jit(jax.vmap(damped))(x, p)
    np.testing.assert_allclose(found["value"], wanted["value"], rtol=1e-14, atol=1e-16)
    np.testing.assert_array_equal(found["count"], wanted["count"])
    assert all(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves(found))
    for run in range(runs):  # by itself it has the same bits
        np.testing.assert_array_equal(
            compiled(x[run][None], {"rate": p["rate"][run][None]})["value"][0], found["value"][run]
        )


@pytest.mark.parametrize("constant", [None, [False, True]])
def test_a_loop_for_a_batch(constant):
    """Semi-implicit Euler on a pendulum, against a scan."""
    pace = np.full(5, 0.01)
    step = lambda numbers, carry, k: (
        carry[0] + numbers[1] * carry[1],
        carry[1] - numbers[1] * jnp.sin(carry[0]) - k.astype(float) * 1e-4,
    )
    loop = simdjit.Loop(
        lambda numbers: numbers,
        lambda numbers: (numbers[0], jnp.zeros_like(numbers[0])),
        step,
        lambda numbers, carry, k: carry[0],
        (np.zeros(()), pace[0]),
        constant,
    )
    angles = np.linspace(0.1, 1.0, 5)
    (angle, rate), recorded = loop.run((angles, pace), 40, 10)

    def by_scan(start):
        numbers = (start, pace[0])
        one = lambda carry, k: (step(numbers, carry, k), carry[0])
        final, series = jax.lax.scan(one, (start, jnp.zeros_like(start)), jnp.arange(40))
        return final, jnp.concatenate([series[::10], final[0][None]])

    (wanted, wanted_rate), series = jax.vmap(by_scan)(jnp.asarray(angles))
    np.testing.assert_allclose(angle, wanted, rtol=1e-13)
    np.testing.assert_allclose(rate, wanted_rate, rtol=1e-12)
    np.testing.assert_allclose(recorded, series, rtol=1e-13)
    assert recorded.shape == (5, 5)


@pytest.mark.parametrize("left_to_xla", [False, True])
def test_a_loop_that_was_written_is_the_same_without_its_functions(tmp_path, left_to_xla):
    """The second prepares by an operation without a rule, so that XLA does it before the first step."""
    prepare = (lambda n: (n[0] + jnp.fft.fft(n[1]).real.sum(), n[1])) if left_to_xla else (lambda n: n)
    functions = (
        prepare,
        lambda prepared: {"x": prepared[0], "count": jnp.zeros((), int)},
        lambda prepared, carry, k: {"x": carry["x"] + prepared[1].sum(), "count": carry["count"] + 1},
        lambda prepared, carry, k: carry["x"],
    )
    loop = simdjit.Loop(*functions, (np.zeros(()), np.zeros(4)), portable=True, cache=tmp_path)
    again = simdjit.Loop.read(loop.written(), cache=tmp_path)
    numbers = np.linspace(0.0, 1.0, 5), np.random.default_rng(0).normal(size=(5, 4))
    expected, found = loop.run(numbers, 6, 2), again.run(numbers, 6, 2)
    assert jax.tree.structure(expected) == jax.tree.structure(found) and again.operations == loop.operations
    for one, other in zip(jax.tree.leaves(expected), jax.tree.leaves(found), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(found[0]["count"], 6)


def test_a_prologue_of_this_process_alone_is_not_written(tmp_path):
    functions = (lambda n: jnp.fft.fft(n).real, lambda n: n[0], lambda n, carry, k: carry, lambda n, carry, k: carry)
    loop = simdjit.Loop(*functions, np.arange(3.0), cache=tmp_path)
    with pytest.raises(simdjit.Unsupported, match="not made for other processes"):
        loop.written()


def test_prologues_by_xla_are_not_mixed_up(tmp_path):
    """Each loop is gone when the next is made, whose parts may then lie where its own lay."""
    for factor in range(1, 9):
        prepare = lambda n, factor=factor: factor * jnp.fft.fft(n).real
        still = lambda n, carry, k: carry
        loop = simdjit.Loop(prepare, lambda n: n, still, still, np.arange(3.0), cache=tmp_path)
        (ends, _), wanted = loop.run(np.arange(3.0)[None], 1), factor * np.fft.fft(np.arange(3.0)).real
        np.testing.assert_allclose(np.ravel(ends), wanted, rtol=1e-6)


def test_names_are_loaded_when_they_are_used():
    code = "import sys, simdjit; print('llvmlite' in sys.modules, 'jax' in sys.modules, dir(simdjit) == sorted(dir(simdjit)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False False True\n"
    with pytest.raises(AttributeError, match="It has: BatchStep, Driver"):
        simdjit.missing  # noqa: B018


def test_what_has_no_rule():
    with pytest.raises(simdjit.Unsupported, match=r"no rule for `fft`|complex"):
        simdjit.compile(lambda x: jnp.fft.fft(x).real, np.zeros(8))


def test_precision_is_that_of_jax():
    for double, name in ((True, "float64"), (False, "float32")):
        with jax.enable_x64(double):
            found = simdjit.compile(jnp.sin, np.zeros(()))(np.linspace(0.0, 1.0, 3))
            assert str(found.dtype) == name
            np.testing.assert_allclose(found, np.sin(np.linspace(0.0, 1.0, 3)), rtol=1e-15 if double else 2e-7)


def test_the_readme_runs():
    shown = re.findall(r"^```python\n(.*?)^```", (PROJECT / "README.md").read_text(encoding="utf-8"), re.S | re.M)
    assert len(shown) == 2
    spaces = [{} for _ in shown]
    for code, space in zip(shown, spaces, strict=True):
        exec(code, space)
    x = np.linspace(0.0, 1.0, 1000)
    np.testing.assert_allclose(spaces[0]["values"], np.exp(-0.3 * x) * np.cos(x), rtol=1e-14)
    assert spaces[1]["angles"].shape == (16, 11)


def imported(path):
    """Packages that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.split(".")[0]


def test_it_imports_what_it_depends_on():
    """The package imports what pyproject.toml names; tests and benchmarks others as well, and each other."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    dependencies = {line.split(">=")[0] for line in project["dependencies"]}
    known = sys.stdlib_module_names | {"simdjit"}
    package = {name for path in (PROJECT / "simdjit").rglob("*.py") for name in imported(path)}
    assert package - known == dependencies
    others = [*(PROJECT / "tests").rglob("*.py"), *(PROJECT / "benchmarks").rglob("*.py")]
    beside = {"pytest", "scipy", *project["optional-dependencies"]["rivals"]} | {path.stem for path in others}
    assert {name for path in others for name in imported(path)} <= known | dependencies | beside


def test_its_words():
    """Those of compiler engineers; a package for JAX users knows no ships."""
    foreign = re.compile(
        r"\b(fly|flies|flown|flying|drawn|told|looked|marine|vehicles?|thrusters?|ships?|hulls?|undertow|w1|w2)\b", re.I
    )
    for path in (*PROJECT.rglob("*.py"), PROJECT / "README.md"):
        if path != Path(__file__):
            assert not foreign.findall(path.read_text(encoding="utf-8")), path.name
