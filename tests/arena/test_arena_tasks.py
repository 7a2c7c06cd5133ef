"""The tasks of the arena: fixed per version, buildable, and of the size that their words say."""

import hashlib
import json
import math

import numpy as np
import pytest

from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.studies.arena.tasks import CELLS, TASKS, VERSION, motion_keys, scenarios, training_keys
from undertow.studies.arena.vehicles import VEHICLES

# Version -> what its tasks hash to. A change of a task or of a vehicle is a new version with a line of its own.
DIGESTS = {1: "668496711786e5ab", 2: "008c90cf876e02f5", 3: "7732cd119760500b"}


def first(task, vehicle):
    """Its only scenario, or the first of several."""
    return next(iter(scenarios(task, vehicle).values()))


def test_the_tasks_of_a_version_stay():
    whole = json.dumps([scenarios(*cell) for cell in CELLS], sort_keys=True)
    assert hashlib.sha256(whole.encode()).hexdigest()[:16] == DIGESTS[VERSION]


def test_fifteen_tasks_on_four_vehicles():
    assert len(TASKS) == 15 and len(VEHICLES) == 4
    # Two vehicles cannot turn upside down, and one has published sets enough to be foreign.
    assert len(CELLS) == len(set(CELLS)) == 12 * 4 - 2 + 3
    every = [keys for cell in CELLS for keys in scenarios(*cell).values()]
    assert len({tuple(sorted(keys)) for keys in every}) == 1  # variants of one campaign


def test_every_published_set_meets_every_other_model_at_three_rates():
    sets = VEHICLES["bluerov2_heavy"].sets
    for rate in (20, 50, 100):
        each = scenarios(f"foreign_{rate}_hz", "bluerov2_heavy").values()
        pairs = {(one["plant"]["vehicle"]["parameters"], one["model"]["vehicle"]["parameters"]) for one in each}
        assert pairs == {(one, other) for one in sets for other in sets if one != other} and len(each) == 20
        assert {one["loop"]["dt"] for one in each} == {1 / rate}


@pytest.mark.full
@pytest.mark.parametrize("task", TASKS)
def test_every_task_builds(task):
    for vehicle in TASKS[task].vehicles:
        built = build(from_data(first(task, vehicle) | {"controller": "pid"}))
        assert built.closed_loop.plant.inputs() == (6 if task == "underactuated" else VEHICLES[vehicle].thrusters)
        assert set(built.scenario.success) == {"position_rms", "orientation_rms"}


@pytest.mark.full
def test_the_model_does_not_know_what_a_task_hides():
    """Low supply, another parameter set and the errors of parameters are of the plant alone."""
    low = build(from_data(first("low_battery", "bluerov2_heavy") | {"controller": "pid"})).resolved
    assert low["plant"]["thruster"]["supply"] == 12 and low["model"]["thruster"]["supply"] == 16
    wrong = first("wrong_model", "bluerov2_heavy")
    assert wrong["model"]["vehicle"]["parameters"] == "wu2018" and wrong["plant"]["vehicle"] == "bluerov2_heavy"
    assert all(any(one["kind"] == "parameter_error" for one in first(*cell)["disturbance"]) for cell in CELLS)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_motion_has_the_speed_of_its_vehicle(vehicle):
    """The largest speed along one axis is 0.8 of the stated one, that of the others follows; from the figure itself."""
    motion, v = motion_keys(vehicle)["reference"], VEHICLES[vehicle]
    rates = [amplitude * rate for amplitude, rate in zip(motion["amplitude"], motion["frequency"], strict=True)]
    assert rates[0] == pytest.approx(0.8 * v.speed) and math.hypot(*rates[:3]) < v.speed
    twice = motion_keys(vehicle, 2.0)["reference"]
    np.testing.assert_allclose(twice["frequency"], 2 * np.array(motion["frequency"]), rtol=1e-12)


def test_training_is_on_no_task():
    """Another motion, current and sea, on the same vehicle."""
    for vehicle in VEHICLES:
        training = training_keys(vehicle)
        for task in TASKS:
            if (task, vehicle) in CELLS:
                keys = first(task, vehicle)
                assert keys["reference"] != training["reference"] and keys["disturbance"] != training["disturbance"]
