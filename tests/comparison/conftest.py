"""A comparison that takes no time: one axis, pushed and measured with noise, in the current folder."""

import copy
from pathlib import Path

import pytest

from undertow.report.figures import writing
from undertow.scenario.reading import dump

BLANK = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'

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

    def write(name="axis", **changes):
        Path(f"{name}.yaml").write_text(dump(copy.deepcopy(AXIS) | changes), encoding="utf-8")
        return f"{name}.yaml"

    return write


@pytest.fixture(autouse=True)
def blank_figures(monkeypatch, request):
    """Figures are made, but blank ones are written unless a test has the fixture `whole_figures`."""
    if "whole_figures" not in request.fixturenames:
        monkeypatch.setattr(writing, "svg", lambda figure: BLANK)
        monkeypatch.setattr(writing, "png", lambda figure: b"blank")


@pytest.fixture
def whole_figures():
    """For tests that look at figures."""
