"""Steps and starts that somebody else's clock calls: by either compiler they keep numbers and state, and agree."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import batch_compiler
from undertow.core.batch_compiler import Unsupported
from undertow.simulation.loop import simd_batch, stepped, stepped_batch
from undertow.simulation.loop.vmap_batch import _batched

NUMBERS = {"stiffness": np.array([2.0, 3.0]), "damping": np.array(0.5)}
STATE = (np.array([0.3, -0.2]), np.zeros(2))


def oscillators(numbers, state, force):
    """One step of 0.1 s of two damped oscillators."""
    position, velocity = state
    velocity = velocity + 0.1 * (force - numbers["stiffness"] * position - numbers["damping"] * velocity)
    return (position + 0.1 * velocity, velocity), {"energy": (velocity**2).sum(), "moves": velocity > 0}


def expected(numbers, state, force):
    position, velocity = state
    velocity = velocity + 0.1 * (force - numbers["stiffness"] * position - numbers["damping"] * velocity)
    return (position + 0.1 * velocity, velocity), (velocity**2).sum(), velocity > 0


def without_simd(monkeypatch):
    """As on a machine that lacks the batch compiler, for which these names are made anew."""
    monkeypatch.setattr(batch_compiler, "_REASON", "the batch compiler cannot be imported")


@pytest.mark.parametrize("backend", ["simd", "xla"])
def test_one_run(monkeypatch, backend):
    if backend == "xla":
        without_simd(monkeypatch)
    step = stepped.CompiledStep(oscillators, NUMBERS, STATE, np.zeros(2))
    assert step.backend == backend
    state, numbers = STATE, NUMBERS
    for force in ([1.0, 0.0], [0.0, -2.0], [0.5, 0.5]):
        stepped.copy_into(step.inputs, np.array(force))
        step()
        state, energy, moves = expected(numbers, state, np.array(force))
        np.testing.assert_allclose(step.outputs["energy"], energy, rtol=1e-14)
        np.testing.assert_array_equal(step.outputs["moves"], moves)
        np.testing.assert_allclose(step.state, state, rtol=1e-14)
        # Numbers that are written hold from the next step on.
        numbers = numbers | {"damping": np.array(0.5 * numbers["damping"])}
        stepped.copy_into(step.numbers, numbers)
    np.testing.assert_array_equal(NUMBERS["damping"], 0.5)
    np.testing.assert_array_equal(STATE[0], [0.3, -0.2])


@pytest.mark.parametrize("backend", ["simd", "xla"])
def test_many_runs(monkeypatch, backend):
    """The damping is each run's own, the stiffness that of all."""
    if backend == "xla":
        without_simd(monkeypatch)
    runs, own = 3, np.array([0.0, 0.5, 1.0])
    steps = stepped_batch.CompiledBatchStep(oscillators, NUMBERS, STATE, np.zeros(2), runs, [False, True])
    assert steps.backend == backend
    steps.put("numbers", [own])
    states = [STATE] * runs
    for k in range(4):
        forces = np.arange(6.0).reshape(3, 2) - k
        steps.put("inputs", forces)
        if k == 2:  # the last run begins again
            steps.put("state", [np.ones((1, 2)), np.zeros((1, 2))], np.array([2]))
            states[2] = (np.ones(2), np.zeros(2))
        found = steps()
        after = [
            expected(NUMBERS | {"damping": c}, state, force)
            for c, state, force in zip(own, states, forces, strict=True)
        ]
        states = [state for state, _, _ in after]
        np.testing.assert_allclose(found["energy"], [energy for _, energy, _ in after], rtol=1e-13)
        np.testing.assert_array_equal(found["moves"], [moves for _, _, moves in after])
        found["energy"][:] = np.nan  # which the caller may


@pytest.mark.parametrize("backend", ["simd", "xla"])
def test_many_starts(monkeypatch, backend):
    if backend == "xla":
        without_simd(monkeypatch)
    prepare = lambda numbers: {"limit": numbers["stiffness"] * 2, "damping": numbers["damping"]}
    begin = lambda known: (known["limit"] + known["damping"], jnp.sin(known["damping"]))
    start = stepped_batch.Starter(prepare, begin, NUMBERS, [False, True])
    assert start.backend == backend
    own = np.array([0.0, 0.5, 1.0, 2.0])
    high, sine = start({"stiffness": np.broadcast_to(NUMBERS["stiffness"], (4, 2)), "damping": own})
    np.testing.assert_array_equal(high, own[:, None] + [4.0, 6.0])
    np.testing.assert_allclose(sine, np.sin(own), rtol=1e-14)


def test_where_the_batch_compiler_is_missing(monkeypatch):
    without_simd(monkeypatch)
    assert "cannot be imported" in batch_compiler.unavailable()
    assert simd_batch.simd_width(64) == 1 and simd_batch.gpu() is None
    for call in (
        lambda: simd_batch.kept_step(oscillators, NUMBERS, STATE, np.zeros(2)),
        lambda: simd_batch.kept_steps(oscillators, NUMBERS, STATE, np.zeros(2), 3, [False, True]),
        lambda: simd_batch.starter(lambda n: n, lambda n: n, NUMBERS, [False, True]),
        lambda: simd_batch.realized_disturbance(None, None),
        lambda: simd_batch.SimdBatchRunner(None, None, []),
    ):
        with pytest.raises(Unsupported, match="cannot be imported"):
            call()


@pytest.mark.parametrize("runs", [1, 4, 5, 8])
def test_runs_are_divided_into_programs_of_one_width(runs):
    """Of four runs here; the last program repeats the last run, which is thrown away."""
    double = _batched(lambda tree: {"twice": 2 * tree["x"], "sum": tree["x"].sum()}, {"x": np.zeros(2)}, 4)
    x = np.arange(2.0 * runs).reshape(runs, 2)
    found = double({"x": x})
    np.testing.assert_array_equal(found["twice"], 2 * x)
    np.testing.assert_array_equal(found["sum"], x.sum(1))
