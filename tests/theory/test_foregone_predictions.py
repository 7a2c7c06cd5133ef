"""What is known about the prediction of a run before anything is linearised."""

from types import SimpleNamespace

import numpy as np
import pytest

from undertow.scenario.build import build
from undertow.studies.prediction.foregone import reason_without_prediction

pytestmark = pytest.mark.full

TIME = np.linspace(0.0, 10.0, 101)
SWING = np.where(np.arange(101) % 2, 1.0, -1.0)[:, None] * np.ones(8)  # V, from record to record


def run_of(thruster, inputs, **steady):
    """As much of an executed run as is looked at: a vehicle with these voltages."""
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": thruster},
        "controller": "pid",
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "loop": {"duration": 10.0},
    }
    outcome = SimpleNamespace(time=TIME, signals={"input": inputs})
    return SimpleNamespace(built=build(scenario), outcome=outcome, steady={"saturated_fraction": 0.0} | steady)


STATIC = {"kind": "t200", "fidelity": "static", "supply": 16}


def test_thrust_without_dynamics_that_swings_about_zero():
    inputs = SWING + np.array([3.0] * 5 + [0.1] + [3.0] * 2)
    assert reason_without_prediction(run_of(STATIC, inputs)).startswith("input 6 swings about 0.08")  # of 51 records
    assert reason_without_prediction(run_of(STATIC, SWING + 3.0)) == ""  # which push against a current
    assert reason_without_prediction(run_of(STATIC, 0.05 * SWING + 0.1)) == ""  # one side of zero


@pytest.mark.parametrize("thruster", [{"kind": "t200", "fidelity": "shaft", "supply": 16}, "linear_voltage"])
def test_a_motor_or_a_straight_curve_has_a_slope(thruster):
    assert reason_without_prediction(run_of(thruster, SWING)) == ""


def test_saturation_and_an_early_end():
    saturated = reason_without_prediction(run_of(STATIC, SWING + 3.0, saturated_fraction=0.25))
    assert saturated == "actuators were saturated 25 % of the time, which the linear model does not capture"
    assert reason_without_prediction(run_of(STATIC, SWING + 3.0, saturated_fraction=0.02)) == ""
    early = SimpleNamespace(steady=None)
    assert reason_without_prediction(early) == "the run did not reach its steady window"
