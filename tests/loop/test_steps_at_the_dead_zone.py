"""Thrusters that are needed for less than the edge of their dead zone: how much their inputs move, and who sees it."""

import pytest

from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.full


def variation(controller, every_step=True, record=0.05):
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "controller": controller,
        "reference": {"kind": "setpoint", "position": [1, 0, 1, 0, 0, 0.5], "settling": 5},
        "loop": {"dt": 0.01, "duration": 40, "record": record},
        "steady": {"start": 30, "every_step": every_step},
    }
    facts = run_scenario(scenario).facts
    return facts.steady["input_variation"], facts.meanings["input_variation"]


def test_a_slower_actuator_loop_moves_less():
    fast, _ = variation("robust")
    slow, _ = variation({"kind": "rcaf", "preset": "robust", "actuator_rate": 8})
    assert 5 < fast < 8
    assert slow < 0.15 * fast


def test_variation_between_records_is_called_so():
    every, meaning = variation("robust")
    between, sparse = variation("robust", every_step=False)
    assert between < 0.3 * every
    assert (meaning.name, sparse.name) == ("input variation", "input variation between records")
    assert "every_step" in sparse.meaning
    at_all_steps, dense = variation("robust", every_step=False, record=0.01)
    assert at_all_steps == pytest.approx(every, rel=0.01) and dense.name == "input variation"
