"""Functions of parts by the batch compiler and by XLA: the same numbers, one program for all numbers of its kind."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import batch_compiler, kept_functions, kept_loops
from undertow.core.kept_functions import Recursion, along_steps, for_each
from undertow.core.process_setup import KEEP_PROGRAMS


def of_undertow(part):
    """As one of undertow, which has a key."""
    part.__module__ = "undertow.core.kept_functions"
    return part


@of_undertow
class Oscillator(eqx.Module):
    stiffness: jax.Array
    key: jax.Array


@of_undertow
def slope(oscillator, at):
    point, direction = at
    energy = lambda x: {"energy": (oscillator.stiffness @ x**2).sum(), "moves": x[0] > 0.0}
    return jax.jvp(lambda x: energy(x)["energy"], (point,), (direction,))


@of_undertow
def eigenvalues(oscillator, at):
    return jnp.linalg.eigvalsh(oscillator.stiffness @ oscillator.stiffness.T + jnp.diag(at))


@of_undertow
def prepare(oscillator):
    return oscillator, jax.random.normal(oscillator.key, (2,))


@of_undertow
def start(prepared):
    return prepared[1], jnp.ones(())


@of_undertow
def step(prepared, carry, k):
    oscillator, chance = prepared
    return carry[0] - 0.1 * oscillator.stiffness @ carry[0] + k.astype(float) * chance, carry[1]


@of_undertow
def record(prepared, carry, k):
    return {"energy": (carry[0] ** 2).sum(), "number": k.astype(float) + carry[1]}


OSCILLATION = Recursion(prepare, start, step, record)
MATRIX = np.array([[2.0, 0.3], [-0.4, 1.5]])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own, in a process that has used no loop, and without code of others, which the tests are."""
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path))
    monkeypatch.setenv(KEEP_PROGRAMS, "1")
    forget(monkeypatch)
    return tmp_path / "native"


def forget(monkeypatch):
    """As a later process."""
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    monkeypatch.setattr(kept_functions, "_EACH", {})


def oscillator(matrix=MATRIX):
    return Oscillator(jnp.asarray(matrix), jax.random.PRNGKey(3))


def rows(count=5):
    chance = np.random.default_rng(1)
    return chance.normal(size=(count, 2)), np.tile(np.eye(2), (3, 1))[:count]


def without_simd(monkeypatch):
    monkeypatch.setattr(batch_compiler, "_REASON", "the batch compiler cannot be imported")


def untraced(monkeypatch):
    monkeypatch.setattr(batch_compiler.simdjit.Loop, "__init__", lambda *_, **__: pytest.fail("a loop was traced"))


@pytest.mark.parametrize("compiler", ["simd", "xla"])
def test_each_row(folder, monkeypatch, compiler):
    """A sum of squares, and its slope 2 x . (column sums of the matrix) along one axis."""
    if compiler == "xla":
        without_simd(monkeypatch)
    points, directions = rows()
    energy, slopes = for_each(slope, oscillator(), (points, directions))
    weights = MATRIX.sum(axis=0)
    np.testing.assert_allclose(energy, points**2 @ weights, rtol=1e-14)
    np.testing.assert_allclose(slopes, (2 * points * weights * directions).sum(axis=1), rtol=1e-13, atol=1e-15)
    assert isinstance(energy, np.ndarray) and slopes.shape == (5,)


@pytest.mark.parametrize("compiler", ["simd", "xla"])
def test_each_step(folder, monkeypatch, compiler):
    if compiler == "xla":
        without_simd(monkeypatch)
    (state, one), recorded = along_steps(OSCILLATION, oscillator(), 6)
    chance = np.asarray(jax.random.normal(jax.random.PRNGKey(3), (2,)))
    x, energies = chance, []
    for k in range(6):
        energies.append((x**2).sum())
        last, x = x, x - 0.1 * MATRIX @ x + k * chance
    np.testing.assert_allclose(recorded["energy"], energies, rtol=1e-12)
    np.testing.assert_allclose(state, last, rtol=1e-12)
    np.testing.assert_array_equal(recorded["number"], np.arange(6) + 1.0)
    assert one == 1.0


def test_one_instant_is_the_start(folder):
    (state, _), recorded = along_steps(OSCILLATION, oscillator(), 1)
    np.testing.assert_array_equal(recorded["number"], [1.0])
    np.testing.assert_allclose((state**2).sum(), recorded["energy"][0], rtol=1e-15)


def test_a_later_process_traces_nothing_for_other_numbers(folder, monkeypatch):
    """Zeros among the rows are numbers as others are."""
    points, directions = rows()
    for_each(slope, oscillator(), (points, directions))
    along_steps(OSCILLATION, oscillator(), 6)
    forget(monkeypatch)
    untraced(monkeypatch)
    energy, slopes = for_each(slope, oscillator(2 * MATRIX), (0 * points, directions))
    assert not energy.any() and not slopes.any()
    assert for_each(slope, oscillator(), (points[:1], directions[:1]))[0].shape == (1,)
    assert along_steps(OSCILLATION, oscillator(2 * MATRIX), 9)[1]["energy"].shape == (9,)


def test_what_has_no_rule_is_left_to_xla_by_later_processes_at_once(folder, monkeypatch):
    points, _ = rows()
    first = for_each(eigenvalues, oscillator(), points)
    expected = [np.linalg.eigvalsh(MATRIX @ MATRIX.T + np.diag(point)) for point in points]
    np.testing.assert_allclose(first, expected, rtol=1e-12)
    forget(monkeypatch)
    untraced(monkeypatch)
    np.testing.assert_array_equal(for_each(eigenvalues, oscillator(), points), first)


def test_code_of_others_is_left_to_xla(folder, monkeypatch):
    untraced(monkeypatch)
    scaled = lambda oscillator, row: 2.0 * row
    np.testing.assert_array_equal(for_each(scaled, oscillator(), rows()[0]), 2 * rows()[0])


def test_a_program_is_looked_for_once_for_a_subject_that_lives(folder, monkeypatch):
    one, (points, directions) = oscillator(), rows()
    for_each(slope, one, (points, directions))
    assert len(kept_functions._EACH) == 1
    monkeypatch.setattr(kept_functions, "program_key", lambda *_: pytest.fail("looked for again"))
    for_each(slope, one, (points, directions))
    del one
    assert not kept_functions._EACH
