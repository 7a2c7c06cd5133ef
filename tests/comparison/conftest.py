"""A comparison that takes no time: one axis, pushed and measured with noise, in the current folder."""

import copy
from pathlib import Path

import pytest

from undertow.report import comparison_page
from undertow.scenario.reading import dump
from undertow.studies.comparison import step_time

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 1e30},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 2.0, "dt": 0.02, "record": 0.1},
}


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    """Writes a scenario with changes into the current folder, and gives the name of its file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(step_time, "_LONGEST", 0.01)  # s of calls of a law, for their median

    def write(name="axis", **changes):
        Path(f"{name}.yaml").write_text(dump(copy.deepcopy(AXIS) | changes), encoding="utf-8")
        return f"{name}.yaml"

    return write


@pytest.fixture(autouse=True)
def no_figures(monkeypatch, request):
    """None are made unless a test has the fixture `whole_figures`."""
    if "whole_figures" not in request.fixturenames:
        monkeypatch.setattr(comparison_page, "comparison_plots", lambda dataset, found: {})


@pytest.fixture
def whole_figures():
    """For tests that look at figures."""
