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
def slope(oscillator, point, direction):
    """A sum of squares, and its slope along one direction."""
    return jax.jvp(lambda x: (oscillator.stiffness @ x**2).sum(), (point,), (direction,))


@of_undertow
def eigenvalues(oscillator, shift, diagonal):
    return shift + jnp.linalg.eigvalsh(oscillator.stiffness @ oscillator.stiffness.T + jnp.diag(diagonal))


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


POINT = np.array([0.7, -1.2])
DIRECTIONS = np.random.default_rng(1).normal(size=(5, 2))


def without_simd(monkeypatch):
    monkeypatch.setattr(batch_compiler, "_REASON", "the batch compiler cannot be imported")


def untraced(monkeypatch):
    monkeypatch.setattr(batch_compiler.simdjit.Loop, "__init__", lambda *_, **__: pytest.fail("a loop was traced"))


@pytest.mark.parametrize("compiler", ["simd", "xla"])
def test_each_row(folder, monkeypatch, compiler):
    """The slope of a sum of squares is 2 x . (column sums of the matrix)."""
    if compiler == "xla":
        without_simd(monkeypatch)
    energy, slopes = for_each(slope, oscillator(), POINT, DIRECTIONS)
    weights = MATRIX.sum(axis=0)
    np.testing.assert_allclose(energy, np.full(5, POINT**2 @ weights), rtol=1e-14)
    np.testing.assert_allclose(slopes, DIRECTIONS @ (2 * POINT * weights), rtol=1e-13, atol=1e-15)
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
    """Zeros are numbers as others are."""
    for_each(slope, oscillator(), POINT, DIRECTIONS)
    along_steps(OSCILLATION, oscillator(), 6)
    forget(monkeypatch)
    untraced(monkeypatch)
    energy, slopes = for_each(slope, oscillator(2 * MATRIX), 0 * POINT, DIRECTIONS)
    assert not energy.any() and not slopes.any()
    assert for_each(slope, oscillator(), POINT, np.eye(2))[0].shape == (2,)
    assert along_steps(OSCILLATION, oscillator(2 * MATRIX), 9)[1]["energy"].shape == (9,)


def test_what_has_no_rule_is_left_to_xla_by_later_processes_at_once(folder, monkeypatch):
    first = for_each(eigenvalues, oscillator(), np.asarray(0.5), DIRECTIONS)
    expected = [0.5 + np.linalg.eigvalsh(MATRIX @ MATRIX.T + np.diag(row)) for row in DIRECTIONS]
    np.testing.assert_allclose(first, expected, rtol=1e-12)
    forget(monkeypatch)
    untraced(monkeypatch)
    np.testing.assert_array_equal(for_each(eigenvalues, oscillator(), np.asarray(0.5), DIRECTIONS), first)


def test_code_of_others_is_left_to_xla(folder, monkeypatch):
    untraced(monkeypatch)
    scaled = lambda oscillator, factor, row: factor * row
    np.testing.assert_array_equal(for_each(scaled, oscillator(), np.asarray(2.0), DIRECTIONS), 2 * DIRECTIONS)


def test_a_program_is_looked_for_once_for_a_subject_that_lives(folder, monkeypatch):
    one = oscillator()
    for_each(slope, one, POINT, DIRECTIONS)
    assert len(kept_functions._EACH) == 1
    monkeypatch.setattr(kept_functions, "program_key", lambda *_: pytest.fail("looked for again"))
    for_each(slope, one, POINT, DIRECTIONS)
    del one
    assert not kept_functions._EACH
