"""The long horizon in figures and on the page: every run, its end, and its metrics by window."""

import re

import numpy as np
import pytest

from undertow.paper.figures.horizons import horizons_figure
from undertow.paper.figures.lags import drifting_figure, lags_figure
from undertow.paper.pages.report import write_report

WINDOWS = [[10.0, 20.0], [100.0, 200.0]]


def row(level, law, composite, bounded, ended, **more):
    lasted = ended >= 200
    by_window = lambda value: [value, 2 * value if lasted else None]
    return {
        "level": level, "law": law, "words": law, "composite": composite, "bounded": bounded,
        "scenario": f"scenarios/long_{level}_{law}.yaml", "status": "completed" if lasted else "diverged", "ended": ended,
        "lasted": lasted, "within": lasted and not bounded, "tracking_rms": by_window(1e-4), "estimation_rms": by_window(0.2),
        "input_variation": by_window(50.0), "weights_peak": by_window(14.0),
        "growth": {"time": [1.0, 10.0, min(ended, 150.0)], "weights_peak": [3.0, 30.0, 300.0]},
    } | more  # fmt: skip


ROWS_OF_FIDELITIES = [
    row("shaft", "rcafc", 500.0, False, 200.0),
    row("electromechanical", "rcafc", 500.0, False, 1.5),
    row("electromechanical", "rcafc", 500.0, True, 200.0),
    row("electromechanical", "w1", 20.0, False, 139.4),
]
MAP = [
    row("", "five", 0, False, 200.0, kind="lag", value=0.05, damping=[453.0, 6000.0]),
    row("", "one", 0, False, 200.0, kind="lag", value=0.05, damping=[453.0, 6000.0]),
    row("", "five", 0, False, 12.0, kind="winding", value=0.0015, damping=[876.0, 4382.0]),
    row("", "five", 0, False, 2.0, kind="winding", value=0.003, damping=None),
]
TIME = np.linspace(0.2, 20, 100)
CURVES = {"time": TIME, "gain": [500 * (1 - np.exp(-TIME))] * 6, "input_variation": 1 / TIME, "tracking": np.exp(-TIME)}
DRIFTING = {"lag": 0.05, "needed": 453.0, "runs": {"free": CURVES, "bounded": CURVES}}
RESULTS = {"fidelity": {}, "horizons": {"duration": 200.0, "windows": WINDOWS, "rows": ROWS_OF_FIDELITIES}, "lags": MAP}


def test_growth_is_drawn_up_to_the_end_of_each_run():
    shaft, motor, survival = horizons_figure(ROWS_OF_FIDELITIES, 200.0).axes
    np.testing.assert_array_equal(shaft.lines[0].get_ydata(), [3.0, 30.0, 300.0])
    crosses = sorted(line.get_xdata()[0] for line in motor.lines if line.get_marker() == "X")
    assert crosses == [1.5, 139.4], "a run that is bounded lasts"
    said = [text.get_text() for text in survival.texts]
    assert sorted(said) == ["1.5 s", "139 s", "completed"]
    tops = sorted(line.get_ydata()[1] for line in survival.lines)
    assert tops == [1.5, 139.4, 200.0]


def test_map_draws_what_was_measured_and_stops_where_runs_ended():
    panels = lags_figure(MAP, WINDOWS).axes
    tracking, life = panels[0], panels[3]
    assert [tuple(line.get_ydata()) for line in tracking.lines] == [(1e-4,), (2e-4,), (1e-4,), (2e-4,)]
    assert tracking.lines[0].get_xdata()[0] == pytest.approx(50.0), "in ms"
    assert all(line.get_markerfacecolor() == "white" for line in life.lines)
    lost = panels[7].lines
    assert [line.get_ydata()[0] for line in lost] == [12.0, 2.0]
    assert all(line.get_markerfacecolor() != "white" for line in lost)


def test_damping_and_what_is_asked_of_it_share_a_panel():
    gains, chattering, error = drifting_figure(DRIFTING).axes
    assert len(gains.lines) == 13 and gains.lines[-1].get_ydata()[0] == 453.0
    np.testing.assert_array_equal(chattering.lines[0].get_ydata(), CURVES["input_variation"])
    assert error.get_yscale() == chattering.get_yscale() == "log"


def test_page_says_how_long_everything_lasted(results, tmp_path):
    page = write_report(results | {key: RESULTS[key] for key in ("horizons", "lags")}, {}, tmp_path).read_text("utf-8")
    words = re.sub(r"<[^>]+>|&nbsp;", " ", page)
    for said in ("diverged at 139 s", "diverged at 1.5 s", "lasts 200 s", "Long runs: 200 s", "10 to 20 s"):
        assert said in words
    assert "above 453" in words and "876 to 4382" in words and "never" in words
    assert "Simulated: level ideal, 10 s." in words
    assert "lasts 20 s" in words, "the comparison over 20 s says so, too"
    colours = dict.fromkeys(re.findall(r'chip (\w+)">(lasts 200 s|diverged at 139 s)', page))
    assert list(colours) == [("holds", "lasts 200 s"), ("partly", "lasts 200 s"), ("fails", "diverged at 139 s")]
