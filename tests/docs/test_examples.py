"""Every example runs; the paper's two give the paper's numbers (benchmark, section 4)."""

import importlib.util
import json
from pathlib import Path

import pytest

from undertow.cli.main import run
from undertow.paper.all_outputs import with_all_outputs
from undertow.report import run_page
from undertow.report.figures import run_files, writing
from undertow.scenario.build import build
from undertow.scenario.reading import read

pytestmark = pytest.mark.docs

EXAMPLES = Path(__file__).parents[2] / "examples"
README = EXAMPLES.parent / "README.md"

# Exit code 0, and what else is known: metric -> (value, relative tolerance), over the steady window.
KNOWN = {
    "paper_example1": {"tracking_rms": (1.6e-4, 0.02), "estimation_rms": (0.201, 0.02), "robust_rms": (0.144, 0.02)},
    "paper_example2": {},
    "w1": {"tracking_rms": (4.58e-3, 0.02)},
    "voltage_limited": {"input_peak": (24.0, 1e-12)},
    "recorded_disturbance": {},
    "inverted_pendulum": {},
    "magnetic_levitation": {},
    "two_link_arm": {},
    "under_actuated": {},
    "own_vehicle": {},
    "observer_based": {},
    "non_affine": {},
    "large_scale": {},
    "bluerov2_heavy": {"position_rms": (0.01473, 0.05), "attitude_rms": (0.00257, 0.05)},
    "browser": {},
    "thruster_failure": {"position_rms": (0.0017, 0.05), "saturated_fraction": (0.0, 1e-12)},
}
VEHICLES = ["my_rov"]  # not scenarios


# Vehicles that take longest. By default these are built; what they compute is compared in tests/loop and tests/paper.
LONG = {
    "bluerov2_heavy",
    "browser",
    "large_scale",
    "observer_based",
    "own_vehicle",
    "paper_example2",
    "recorded_disturbance",
    "thruster_failure",
}
BLANK = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'


def test_every_example_is_tested():
    assert {path.stem for path in EXAMPLES.glob("*.yaml")} == {*KNOWN, *VEHICLES}


@pytest.mark.parametrize("name", VEHICLES)
def test_vehicle(name, capsys):
    assert run(["check", str(EXAMPLES / f"{name}.yaml")]) == 0
    assert capsys.readouterr().out.count(": 0 errors, 0 pieces of advice. It can be used") == 1


@pytest.mark.parametrize("name", sorted(LONG))
def test_long_scenario_is_built(name):
    built = build(read(EXAMPLES / f"{name}.yaml"))
    assert built.closed_loop.plant.inputs() in (8, 16) and built.scenario.loop.duration >= 10


def answer_in_readme():
    """Lines that README shows of what its first simulation prints."""
    _, command, following = README.read_text(encoding="utf-8").partition(
        "examples/thruster_failure.yaml --out runs/first"
    )
    assert command
    return [
        line.strip() for line in following.split("`runs/first/run.html`")[0].splitlines() if line.startswith("    ")
    ]


def test_readme_shows_an_answer():
    assert len(answer_in_readme()) == 2


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in KNOWN])
def test_scenario(name, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(writing, "svg", lambda figure: BLANK)
    monkeypatch.setattr(writing, "png", lambda figure: b"blank")
    monkeypatch.setattr(run_files, "small_png", lambda figure: b"blank")
    monkeypatch.setattr(run_page, "replay_of", lambda *_: None)
    assert run(["simulate", str(EXAMPLES / f"{name}.yaml"), "--out", str(tmp_path / "out"), "--no-prediction"]) == 0
    steady = with_all_outputs(json.loads((tmp_path / "out" / "metrics.json").read_text())["steady"])
    for metric, (value, tolerance) in KNOWN[name].items():
        assert steady[metric] == pytest.approx(value, rel=tolerance)
    if name == "thruster_failure":
        printed = capsys.readouterr().out.splitlines()
        assert [line for line in answer_in_readme() if line not in printed] == []
    if name == "voltage_limited":
        assert steady["saturated_fraction"] > 0.05


def example(name):
    """An example in Python, as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_python_api(capsys):
    assert example("python_api").main(fast=True).status == 0
    assert "position_rms" in capsys.readouterr().out


@pytest.mark.slow
def test_mujoco_comparison(capsys, tmp_path):
    """Not worse than docs/how-to/independent-physics.md says."""
    found = example("mujoco_comparison").main(fast=True, figure=str(tmp_path / "agreement.png"))
    said = {"nu_dot": 1e-12, "position": 1e-7, "attitude": 1e-7, "voltage": 1e-5}
    assert len(found) == 4
    assert all(difference < said[name.split(",")[0].split()[0]] for name, difference in found.items())
    assert "undertow completed, MuJoCo completed" in capsys.readouterr().out
    assert (tmp_path / "agreement.png").stat().st_size > 1e4
