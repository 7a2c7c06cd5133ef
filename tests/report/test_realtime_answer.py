"""What is said after a run in real time: numbers of its log in closed form."""

import numpy as np
import pytest

from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.report.answers.realtime_answer import answer_of_realtime_run

UNITS = ("m", "m", "m", "rad", "rad", "rad")
COLUMNS = ("north", "east", "down", "roll", "pitch", "yaw")
CRITERION = {"position_rms": 0.05, "attitude_rms": 0.05, "saturated_fraction": 0.25}
STATISTICS = {"ended": "completed", "steps": 1001, "sampling_time": 0.01, "overruns": 0, "missed": 0, "stale": 0}


def log_of(measured, reference=None):
    """A log of ten seconds at 100 Hz."""
    time = np.arange(1001) * 0.01
    rows = np.broadcast_to(measured, (1001, 6)).astype(float)
    signals = {
        "measured_position": Series(time, rows, COLUMNS, "m, rad"),
        "reference": Series(time, np.zeros((1001, 6)) if reference is None else reference, COLUMNS, "m, rad"),
        "commanded_input": Series(time, np.tile([3.0, -7.5], (1001, 1)), ("T1", "T2"), "V"),
    }
    return Log(signals, "run.mcap", "MCAP")


def test_rms_of_each_axis_and_largest_distance():
    answer = answer_of_realtime_run(log_of([0.03, 0, 0.04, 0, 0, 0.02]), UNITS, CRITERION, STATISTICS)
    assert answer.good
    assert answer.verdict.startswith("The vehicle held its reference from 5 to 10 s, by its own measurement.")
    position = f"{100 * 0.05 / np.sqrt(3):.2g} cm from the reference (limit 5 cm), rms per axis; at most 5 cm."
    attitude = f"{np.degrees(0.02 / np.sqrt(3)):.2g} degrees from the reference (limit 2.9 degrees), rms per axis"
    assert answer.lines[0] == f"Position: {position}"
    assert answer.lines[1].startswith(f"Attitude: {attitude}")
    assert answer.lines[2:] == ("Commands up to 7.5 V.", "1001 steps at 100 Hz; none late.")


def test_the_first_half_and_whole_turns_do_not_count():
    measured = np.tile([0.0, 0, 0, 0, 0, 2 * np.pi - 0.001], (1001, 1))
    measured[:500, 0] = 3.0
    assert answer_of_realtime_run(log_of(measured), UNITS, CRITERION, STATISTICS).good


def test_a_vehicle_that_drifts_away_did_not_hold():
    answer = answer_of_realtime_run(log_of([0, 2.0, 0, 0, 0, 0]), UNITS, CRITERION, STATISTICS)
    assert answer.good is False and "did not hold its reference" in answer.verdict
    assert "1.2 m from the reference (limit 5 cm)" in answer.lines[0]


@pytest.mark.parametrize("log", [None, log_of(np.full(6, np.nan))], ids=["not read", "nothing measured"])
def test_what_is_not_known_is_not_judged(log):
    answer = answer_of_realtime_run(log, UNITS, CRITERION, STATISTICS)
    assert answer.good is None and answer.verdict.startswith("Ended: completed")
    assert "is not known" in answer.lines[0]


def test_late_steps_and_the_supervisor_are_named():
    changes = [{"state": "ACTIVE", "time": 0.0}, {"state": "SAFE", "time": 4.0}, {"state": "ACTIVE", "time": 5.0}]
    statistics = STATISTICS | {"overruns": 2, "stale": 3, "transitions": changes}
    lines = answer_of_realtime_run(log_of(np.zeros(6)), UNITS, CRITERION, statistics).lines
    assert "2 commands after their deadline, 3 steps without a new measurement" in lines[-2]
    assert lines[-1] == "The supervisor intervened once, last with SAFE at 4 s."
