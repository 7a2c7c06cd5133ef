"""A step of many runs whose memory is kept: the bits of `Step`, whatever the other runs are."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simdjit

pytestmark = pytest.mark.compiler


def function(numbers, state, inputs):
    """A damped oscillator with a counter: a tree in, a tree out."""
    position, velocity, count = state
    force = inputs - numbers["stiffness"] * jnp.sin(position) - numbers["damping"] * velocity
    velocity = velocity + 0.01 * force
    new = position + 0.01 * velocity, velocity, count + 1
    return new, {"energy": (velocity**2).sum(), "even": count % 2 == 0}


NUMBERS = {"stiffness": np.array([2.0, 3.0]), "damping": np.zeros(())}
STATE = (np.zeros(2), np.ones(2), np.zeros((), dtype=int))


def stepper(runs, constant=None):
    return simdjit.BatchStep(function, NUMBERS, STATE, np.zeros(2), runs, constant)


@pytest.mark.parametrize("runs", [1, 7, 8, 21])
def test_bits_of_single_steps(runs):
    rng = np.random.default_rng(runs)
    several, damping = stepper(runs), rng.uniform(0.0, 1.0, runs)
    stiffness, start = rng.uniform(1.0, 3.0, (runs, 2)), rng.normal(size=(runs, 2))
    several.put("numbers", {"damping": damping, "stiffness": stiffness})
    several.put("state", (start, 0 * start, np.zeros(runs, dtype=int)))
    alone = [simdjit.Step(function, NUMBERS, STATE, np.zeros(2)) for _ in range(runs)]
    for i, step in enumerate(alone):
        step.numbers["damping"][...], step.numbers["stiffness"][...] = damping[i], stiffness[i]
        step.state[0][...], step.state[1][...] = start[i], 0.0
    for k in range(5):
        inputs = rng.normal(size=(runs, 2))
        several.put("inputs", inputs)
        found = several()
        assert (found["even"] == (k % 2 == 0)).all()
        for i, step in enumerate(alone):
            step.inputs[...] = inputs[i]
            step()
            assert found["energy"][i] == step.outputs["energy"]


def test_some_runs_are_written():
    several = stepper(10, constant=[True, False])
    several.put("numbers", [np.arange(10.0)[:, None] * np.ones(2)])
    before = several()["energy"]
    several.put("state", [5 * np.ones((2, 2)), np.zeros((2, 2)), np.zeros(2, dtype=int)], runs=np.array([3, 9]))
    after = several()["energy"]
    untouched = np.delete(np.arange(10), [3, 9])
    reference = stepper(10, constant=[True, False])
    reference.put("numbers", [np.arange(10.0)[:, None] * np.ones(2)])
    np.testing.assert_array_equal(reference()["energy"], before)
    np.testing.assert_array_equal(reference()["energy"][untouched], after[untouched])
    assert (reference()["energy"][[3, 9]] != after[[3, 9]]).all()


def test_what_it_refuses():
    with pytest.raises(simdjit.Unsupported, match="a state that changes its type"):
        simdjit.BatchStep(lambda n, s, u: (s.astype(int), u), (), np.zeros(2), np.zeros(2), 3)
    with pytest.raises(simdjit.Unsupported, match=r"no rule for `fft`|complex"):
        simdjit.BatchStep(lambda n, s, u: (s, jnp.fft.fft(u).real), (), np.zeros(2), np.zeros(8), 3)


def test_a_step_that_was_written_is_the_same_without_its_function(tmp_path):
    step = simdjit.Step(function, NUMBERS, STATE, np.zeros(2), cache=tmp_path, portable=True)
    again = simdjit.Step.read(step.written(), NUMBERS, STATE, np.zeros(2), cache=tmp_path)
    for inputs in ([1.0, 0.0], [0.0, -2.0], [0.5, 0.5]):
        for one in (step, again):
            one.inputs[...] = inputs
            one()
        expected, found = jax.tree.leaves((step.state, step.outputs)), jax.tree.leaves((again.state, again.outputs))
        assert len(expected) == len(found)
        for value, other in zip(expected, found, strict=True):
            np.testing.assert_array_equal(value, other)
    assert jax.tree.structure(step.outputs) == jax.tree.structure(again.outputs)
