"""A run's page lists its faults and the transitions of its supervisor."""

from undertow.report.run_tables import fault_rows, navigation_rows, transition_rows
from undertow.supervision.conditions import State
from undertow.supervision.transition_log import Transition


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
        [Transition(10.05, State.DEGRADED, "saturated", 2.0, 0.0), Transition(11, State.ACTIVE, "", 0, 0)]
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
