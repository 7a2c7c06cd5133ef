"""A campaign that takes no time: one axis, pushed and measured with noise."""

import copy

import pytest

from undertow.report import campaign_page, run_page
from undertow.report.figures import writing
from undertow.simulation.loop import vmap_batch
from undertow.studies.campaign.task import task_context

BLANK = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'

SCENARIO = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20.0},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 2.0, "dt": 0.02, "record": 0.1},
}
CAMPAIGN = {
    "scenario": SCENARIO,
    "trials": 40,
    "chunk": 16,
    "vary": {"disturbance.amplitude": {"uniform": [0.5, 2.0]}},
    "requirements": {"position_rms": {"below": 0.2, "share": 0.5}},
    "seed": 7,
}


@pytest.fixture
def campaign():
    """The campaign, to be changed."""
    return lambda **changes: copy.deepcopy(CAMPAIGN) | changes


@pytest.fixture
def campaign_folder(tmp_path):
    """Where campaign files stand. Of equal campaigns in one folder only the first is compiled."""
    return tmp_path


@pytest.fixture
def campaign_file(campaign_folder, campaign):
    """A file of the campaign with changes."""
    from undertow.scenario.reading import dump

    def write(name="small", **changes):
        path = campaign_folder / f"{name}.yaml"
        path.write_text(dump(campaign(**changes)), encoding="utf-8")
        return path

    return write


@pytest.fixture
def whole_figures():
    """For tests that look at figures: they are drawn, which takes most of the time of a small campaign."""


@pytest.fixture(autouse=True)
def blank_figures(monkeypatch, request):
    """Unless a test has the fixture `whole_figures`, a campaign has none, and those of a run are blank."""
    if "whole_figures" not in request.fixturenames:
        monkeypatch.setattr(campaign_page, "_plots", lambda results, found: {})
        monkeypatch.setattr(writing, "svg", lambda figure: BLANK)
        monkeypatch.setattr(writing, "png", lambda figure: b"blank")
        monkeypatch.setattr(run_page, "replay_of", lambda *_: None)


@pytest.fixture(params=["simd", "xla"])
def backend(request, monkeypatch):
    """Programs of lanes, and what is used where there is no such program."""
    monkeypatch.setattr(vmap_batch, "_WIDTH", 8)
    monkeypatch.setitem(SCENARIO["loop"], "backend", request.param)
    task_context.cache_clear()
    yield request.param
    task_context.cache_clear()
