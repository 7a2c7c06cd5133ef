"""Loops that are kept: found by their structure without tracing, and never those of another one."""

import copy
import dataclasses

import jax
import numpy as np
import pytest

from undertow.core import kept_loops, program_key
from undertow.core.errors import BadInput
from undertow.core.process_setup import KEEP_PROGRAMS
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.physics.plants import double_integrator
from undertow.run import Run, simulate, simulate_scenario
from undertow.simulation.loop import simd_batch

SCENARIO = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20.0},
    "controller": {"kind": "pid", "frequency": 2.1},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "disturbance": [{"kind": "sinusoid", "amplitude": 0.7}, {"kind": "sinusoid", "amplitude": 0.1}],
    "loop": {"duration": 0.5, "dt": 0.01, "record": 0.02},
    "steady": {"start": 0.1},
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own, in a process that has used no loop, and without code of others, which the tests are."""
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path))
    monkeypatch.setenv(KEEP_PROGRAMS, "1")
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    return tmp_path / "native"


@pytest.fixture
def later(monkeypatch):
    """As a later process: no loop is in memory, and none may be traced."""

    def forbid():
        monkeypatch.setattr(kept_loops, "_LOOPS", {})
        untraced(monkeypatch)

    return forbid


def untraced(monkeypatch):
    monkeypatch.setattr(simd_batch.simdjit.Loop, "__init__", lambda *_, **__: pytest.fail("a loop was traced"))


def changed(**values):
    """The scenario with other values in some of its sections."""
    data = copy.deepcopy(SCENARIO)
    for section, value in values.items():
        data[section] |= value
    return data


def position(run):
    return run.dataset["position"].values


def loops(folder):
    """Entries that hold loops, which are compressed; those of XLA are not."""
    return [path for path in sorted(folder.glob("*.xla")) if path.read_bytes()[32:34] == b"x\x01"]


OTHER_NUMBERS = changed(controller={"frequency": 2.3}, plant={"limit": 15.0})


@pytest.mark.full
def test_a_later_process_finds_it_for_other_numbers(folder, later, monkeypatch):
    expected = position(simulate_scenario(OTHER_NUMBERS))
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    for path in folder.glob("*"):
        path.unlink()
    simulate_scenario(SCENARIO)
    assert len(loops(folder)) == 1
    later()
    np.testing.assert_array_equal(position(simulate_scenario(OTHER_NUMBERS)), expected)


@pytest.mark.full
@pytest.mark.parametrize(
    "values",
    [
        {"loop": {"method": "euler"}},
        {"loop": {"substeps": 2}},
        {"loop": {"dt": 0.02}},
        {"loop": {"record": 0.04}},
        {"plant": {"axes": 2}, "reference": {"position": [1.0, 1.0]}},
        {"controller": {"kind": "lqi", "frequency": None}},
        {"controller": {"frequency": 2.0}},  # with a gain of exactly one, which the program leaves out
    ],
    ids=lambda values: "-".join(f"{section}.{key}" for section, value in values.items() for key in value),
)
def test_another_structure_is_another_loop(folder, monkeypatch, values):
    data = changed(**values)
    if data["controller"].get("frequency", 0) is None:
        del data["controller"]["frequency"]
    simulate_scenario(SCENARIO)
    found = position(simulate_scenario(data))
    assert len(loops(folder)) == 2
    monkeypatch.delenv(KEEP_PROGRAMS)
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    np.testing.assert_array_equal(position(simulate_scenario(data)), found)


def test_other_sources_are_another_loop(folder, monkeypatch):
    simulate_scenario(SCENARIO)
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    monkeypatch.setattr(program_key, "installation", lambda: ("other sources",))
    simulate_scenario(SCENARIO)
    assert len(loops(folder)) == 2


@pytest.mark.full
@pytest.mark.parametrize("damage", ["cut off", "one bit", "empty", "of no use"])
def test_a_damaged_entry_is_made_again(folder, monkeypatch, damage):
    expected = position(simulate_scenario(SCENARIO))
    (entry,) = loops(folder)
    contents = entry.read_bytes()
    monkeypatch.setattr(kept_loops, "_LOOPS", {})
    if damage == "one bit":
        entry.write_bytes(contents[:200] + bytes([contents[200] ^ 1]) + contents[201:])
    elif damage == "of no use":  # whole, but no loop
        monkeypatch.setattr(kept_loops, "kept_code", lambda key, make: b"no loop")
    else:
        entry.write_bytes(contents[: len(contents) // 2] if damage == "cut off" else b"")
    np.testing.assert_array_equal(position(simulate_scenario(SCENARIO)), expected)


def test_beside_code_of_others_it_is_used_again_in_this_process_alone(folder, monkeypatch):
    monkeypatch.delenv(KEEP_PROGRAMS)
    simulate_scenario(SCENARIO)
    assert not loops(folder)
    untraced(monkeypatch)
    simulate_scenario(OTHER_NUMBERS)


def test_again_with_other_values(monkeypatch):
    """As the changed file, without tracing anything."""
    run = simulate_scenario(SCENARIO)
    before = position(run)
    expected = changed(controller={"frequency": 2.2})
    expected["disturbance"][0]["amplitude"] = 0.3
    expected = position(simulate_scenario(expected))
    untraced(monkeypatch)
    other = run.again(controller__frequency=2.2, disturbance__0__amplitude=0.3)
    assert isinstance(other, Run)
    np.testing.assert_array_equal(position(other), expected)
    np.testing.assert_array_equal(position(run.again()), before)
    np.testing.assert_array_equal(
        position(other.again(**{"controller.frequency": 2.1, "disturbance[0].amplitude": 0.7})), before
    )


def test_again_says_what_is_wrong():
    run = simulate_scenario(SCENARIO)
    with pytest.raises(BadInput, match=r"`controller.frequenzy`.*`frequency`"):
        run.again(controller__frequenzy=2.0)
    with pytest.raises(BadInput, match=r"`controller.frequency` must be positive"):
        run.again(controller__frequency=-2.0)
    with pytest.raises(BadInput, match="one of the 2 entries"):
        run.again(disturbance__2__amplitude=0.1)
    of_objects = simulate(run.loop.plant, run.loop.controller, run.loop.reference, duration=0.1)
    with pytest.raises(BadInput, match="run of a scenario"):
        of_objects.again(seed=1)
    assert isinstance(run.loop.plant, type(double_integrator()))


@pytest.mark.full
def test_steps_of_an_autopilot_are_found_by_a_later_process(folder, monkeypatch):
    """For other gains, without tracing."""

    def outputs(data):
        autopilot = Autopilot(data)
        steps = [autopilot.start([0.0], [0.0], target=[1.0])]
        return np.array([*steps, *(autopilot.step([0.1 * i], [0.3], target=[1.0]) for i in range(3))])

    expected = outputs(OTHER_NUMBERS)
    monkeypatch.delenv(KEEP_PROGRAMS)
    np.testing.assert_array_equal(outputs(OTHER_NUMBERS), expected)
    monkeypatch.setenv(KEEP_PROGRAMS, "1")
    untraced(monkeypatch)
    np.testing.assert_array_equal(outputs(OTHER_NUMBERS), expected)
    assert (outputs(SCENARIO) != expected).any()


def test_arrays_that_a_function_closes_over_count(folder):
    """They are constants of its program."""

    def doubled(factor):
        return Doubled(np.asarray(factor)).of

    for factor in (2.0, 3.0):
        step = simd_batch.kept_step(doubled(factor), np.ones(2), (), np.array([1.0, 2.0]))
        step()
        np.testing.assert_array_equal(step.outputs, factor * np.array([1.0, 2.0]))


@dataclasses.dataclass(frozen=True)
class Doubled:
    factor: np.ndarray

    def of(self, numbers, state, inputs):
        return (), self.factor * numbers * inputs


# As code of undertow, which has a key.
Doubled.__module__ = "undertow.run"
Doubled.of.__module__ = "undertow.run"


def test_another_generator_of_random_numbers_is_another_loop(folder):
    """Also in the same process."""
    partitionable = jax.config.jax_threefry_partitionable
    keys = []
    for setting in (partitionable, not partitionable, partitionable):
        with jax.threefry_partitionable(setting):
            keys.append(program_key.program_key("random"))
    assert keys[0] == keys[2] != keys[1]
