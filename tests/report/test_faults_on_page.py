"""A run's page lists its faults and the transitions of its supervisor, and its figures mark when."""

import numpy as np

from undertow.control.supervision.conditions import State
from undertow.control.supervision.transition_log import SupervisorTransition
from undertow.report.figures.fault_marks import fault_marks
from undertow.report.figures.run import run_plots
from undertow.report.plotted import Shown
from undertow.report.run_tables import fault_rows, navigation_rows, transition_rows
from undertow.report.signal_names import lost_thrusters
from undertow.scenario.results.run_facts import facts_from


def test_rows_of_faults():
    entries = [
        {"target": "thruster", "number": 3, "mode": "scale", "severity": 0.5, "onset": 20.0},
        {"target": "position", "mode": "nan", "onset": [1.0, 2.0], "duration": 3.0},
    ]
    assert fault_rows(entries, ["T1 bow", "T2 stern", "T3 lift left"]).rows == [
        ("thruster T3 lift left", "scale", "0.5", "20 s", "to the end"),
        ("position", "nan", "-", "1 to 2 s", "3 s"),
    ]


def test_rows_of_transitions():
    rows = transition_rows(
        [
            SupervisorTransition(10.05, State.DEGRADED, "saturated", 2.0, 0.0),
            SupervisorTransition(11, State.ACTIVE, "", 0, 0),
        ]
    )
    assert rows.rows == [("10.05 s", "DEGRADED", "saturated: 2, limit 0"), ("11 s", "ACTIVE", "")]


def test_rows_of_a_navigation_filter():
    """What it assumed, its innovations, NEES with the number that is expected, and what was found."""
    sensor = {"sensor": "compass", "noise": [0.01], "correlated": [0.05, 0.05], "correlation_time": [None, None]}
    found = {"innovation_rms": 1.7, "innovation_correlation": 0.4, "inconsistent": 0.25}
    shown = navigation_rows({"sensors": [sensor | found], "nees": 45.0, "findings": ["It is wrong"]})
    assert shown.rows == [("compass", "0.01", "0.05", "constant", 1.7, 0.4, "25.0 %")]
    assert "is 45; 9 is expected" in shown.sentences[0] and shown.sentences[-1] == "It is wrong."
    early = navigation_rows({"sensors": [], "nees": None, "findings": []})
    assert "is not known before the steady window" in early.sentences[0]


def test_a_thruster_that_was_taken_out_of_use_is_named_with_its_time():
    found = SupervisorTransition(16.3, State.DEGRADED, "thruster_lost", 1.0, 0.0)
    rows = transition_rows([found], [("T2 bow port", 16.3)])
    assert rows.sentences == ("The supervisor took T2 bow port out of use at 16.3 s.",)
    assert transition_rows([found]).sentences == ()


def test_a_tracking_error_without_a_lost_thruster_does_not_exclude_one():
    away = SupervisorTransition(16.3, State.DEGRADED, "attitude_error", 1.2, 1.0)
    (sentence,) = transition_rows([away], []).sentences
    assert "no thruster was found to have failed" in sentence and "cannot exclude it" in sentence
    assert transition_rows([away]).sentences == ()  # nothing watched the thrusters
    assert "T2" in transition_rows([away], [("T2", 16.3)]).sentences[0]
    assert transition_rows([away._replace(reason="saturated")], []).sentences == ()


FAULTS = "faults: [{target: thruster, number: 2, mode: 'off', onset: 8}, {target: depth, mode: nan, onset: [1, 2]}]"


def faulty(make_run):
    """A run in which thruster 2 is off from 8 s on and out of use from 9 s on, thruster 5 out of use for a while."""
    run = make_run()
    lost = np.zeros((run.sizes["time"], 8))
    lost[90:, 1] = 1
    lost[40:60, 4] = 1
    run["lost_thrusters"] = ("time", "actuator"), lost
    run.attrs["scenario"] = FAULTS
    return run


def test_losses_have_the_time_of_the_first_record(make_run):
    assert lost_thrusters(faulty(make_run)) == [("T5", 4.0), ("T2", 9.0)]
    assert lost_thrusters(make_run()) is None
    run = faulty(make_run)
    run["lost_thrusters"] *= 0
    assert lost_thrusters(run) == []


def test_figures_mark_the_onset_of_a_fault_and_when_the_thruster_was_out_of_use(make_run):
    run = faulty(make_run)
    marks = [(mark.time, mark.word) for mark in fault_marks(run, facts_from(run.attrs).faults)]
    assert marks == [(8.0, "T2 off"), (4.0, "T5 out of use"), (9.0, "T2 out of use")]
    assert fault_marks(make_run()) == []
    first, *others = run_plots(Shown(run, facts_from(run.attrs).faults))["tracking"]().axes
    assert [note.get_text() for note in first.texts] == ["T5 out of use", "T2 off", "T2 out of use"]
    assert not any(panel.texts for panel in others)
    for panel in (first, *others):
        lines = [float(line.get_xdata()[0]) for line in panel.lines if np.ptp(line.get_xdata()) == 0]
        assert sorted(lines) == [4.0, 8.0, 9.0]
