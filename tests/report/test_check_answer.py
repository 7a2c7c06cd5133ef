"""The answers of `undertow check` and of a vehicle: counts, what the numbers of a vehicle mean, and the next command."""

import dataclasses
import math

import numpy as np
import pytest

import undertow as ut
from undertow.physics.vehicles.facts import facts_of
from undertow.report.answers.check_answer import answer_of_check
from undertow.report.answers.vehicle_answer import answer_of_vehicle, vehicle_lines
from undertow.scenario.checks.check import Report
from undertow.scenario.checks.finding import advice, error


def facts(**numbers):
    """A vehicle of 10 kg in water of 100 N, righted by 100 N times 2 cm per radian."""
    vehicle = dataclasses.replace(
        ut.vehicles.bluerov2_heavy(),
        mass=np.float64(10.0),
        weight=np.float64(100.0),
        buoyancy=np.float64(100.0),
        r_g=np.array([0.0, 0.0, 0.02]),
        r_b=np.zeros(3),
        linear_damping=np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        quadratic_damping=np.diag([10.0, 20.0, 30.0, 1.0, 1.0, 1.0]),
    )
    return facts_of(vehicle)._replace(**numbers)


def test_lines_of_a_vehicle():
    weight, righting, drag, thrusters = vehicle_lines(facts())
    assert weight == "Its mass is 10 kg, and it is neutral in water."
    assert righting.endswith(f"it is righted by {100 * 0.02 * math.sin(math.radians(10)):.2g} N m.")
    assert drag == "Its drag at 1 m/s is 11 N forward, 22 N sideways and 33 N vertically."
    assert thrusters == "Its 8 thrusters control all six degrees of freedom."


@pytest.mark.parametrize(
    "buoyancy, words", [(103.0, "floats up: it is 3 N (3 %) lighter"), (98.0, "sinks: it is 2 N (2 %) heavier")]
)
def test_a_vehicle_that_is_not_neutral(buoyancy, words):
    assert words in next(vehicle_lines(facts(buoyancy=buoyancy)))


def test_a_vehicle_that_nothing_rights_with_one_thruster():
    one = facts(r_g=np.zeros(3), positions=np.array([[-0.5, 0.0, 0.0]]), directions=np.array([[1.0, 0.0, 0.0]]))
    _, righting, _, thrusters = vehicle_lines(one)
    assert righting == "Nothing rights it in roll and pitch without thrust."
    assert thrusters == "Its thruster controls 1 of the six degrees of freedom."


def test_what_is_found_decides_the_verdict():
    unlikely, wrong = advice("arm", "size", "be larger", "1 m"), error("gravity", "weight", "be positive", "-1 N")
    answers = [answer_of_vehicle(facts(), found) for found in ((), (unlikely,), (wrong, unlikely))]
    assert [answer.good for answer in answers] == [True, None, False]
    assert answers[1].lines[0] == "Advice: `size` should be larger, but is 1 m."
    reports = [Report(tuple((finding, "") for finding in found)) for found in ((), (unlikely,), (unlikely, wrong))]
    scenarios = [answer_of_check("s.yaml", report._replace(kind="scenario")) for report in reports]
    assert [answer.good for answer in scenarios] == [True, None, False]
    assert scenarios[0].lines == ("Next: undertow simulate s.yaml",)
    assert scenarios[2].lines[0] == "Begin with: `weight` must be positive, but is -1 N."


@pytest.mark.parametrize(
    "kind, thing, options, entry",
    [
        ("controllers", "adrc", {}, "controller: adrc"),
        ("vehicles", "odin", {"mass": 130}, "plant: {vehicle: {kind: odin, mass: 130}}"),
        ("sensors", "./altimeter.py:altimeter", {}, "navigation: {sensors: [./altimeter.py:altimeter]}"),
    ],
)
def test_where_a_part_goes(kind, thing, options, entry):
    lines = answer_of_check(thing, Report((), kind=kind), options).lines
    assert lines == (f"Next: write `{entry}` in a scenario, and run `undertow simulate` with it.",)
