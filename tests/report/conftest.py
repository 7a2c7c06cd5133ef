import numpy as np
import pytest
import xarray as xr

from undertow.paper.figures.fidelity import fidelity_figure
from undertow.paper.pages.report import write_report
from undertow.report.figures import run_figures
from undertow.report.plotted import Shown
from undertow.report.replay.replay_data import ReplayData, Thrusters


def run_of(controller="rcafc", axes=6, inputs=8, status="completed", ended=20.0, samples=201):
    """A run in the shape of undertow's datasets, with signals that can be told apart."""
    time = np.linspace(0.0, 20.0, samples)
    size = {"rcafc": 1e-4, "rafc": 1e-2}[controller]
    desired = np.ones((samples, axes)) * np.arange(1, axes + 1)
    error = desired * np.exp(-time)[:, None] + size * np.sin(3 * time)[:, None]
    d = 3 * np.sin(time)[:, None] * np.arange(1, axes + 1)
    miss = (100 * size * np.cos(time) + 40 * np.exp(-30 * time))[:, None] * np.ones(axes)
    volts = 10 * np.sin(time)[:, None] * np.arange(1, inputs + 1)
    if status != "completed":
        volts = volts * np.exp(np.minimum(time, ended) * 4)[:, None]
        d = d * np.exp(np.minimum(time, ended) * 4)[:, None]
    per_axis = {
        "position": desired - error,
        "velocity": error.copy(),
        "measured_position": desired - error,
        "measured_velocity": error,
        "reference": desired,
        "error": error,
        "uncertainty": d,
        "estimate": d + miss,
        "robust_term": miss / 2,
        "predicted_position": desired - error + 2e-3,
    }
    per_input = {"input": volts, "commanded_input": 2 * volts}
    numbers = np.arange(1, inputs + 1)
    names = ["north", "east", "down", "roll", "pitch", "yaw", "extra"][:axes]
    units = ["m", "m", "m", "rad", "rad", "rad", "1"][:axes]
    return xr.Dataset(
        {name: (("time", "axis"), values) for name, values in per_axis.items()}
        | {name: (("time", "actuator"), values, {"units": "V"}) for name, values in per_input.items()},
        coords={
            "time": ("time", time),
            "axis": ("axis", names, {"unit_of_each": ", ".join(units)}),
            "actuator": ("actuator", numbers, {"names": ", ".join(f"T{n}" for n in numbers)}),
        },
        attrs={"status": status, "ended": ended},
    )


@pytest.fixture(scope="session")
def runs():
    return {name: run_of(name) for name in ("rcafc", "rafc")}


@pytest.fixture(scope="session")
def make_run():
    return run_of


def metrics(scale):
    overall = {
        "position_rms": 1.6e-4,
        "attitude_rms": 1.6e-4,
        "tracking_rms": 1.6e-4,
        "tracking_max": 6e-4,
        "estimation_rms": 0.201,
        "uncertainty_rms": 3.224,
        "robust_rms": 0.144,
        "model_rms": 1e-3,
        "input_rms": 17.8,
        "input_peak": 56.6,
        "input_variation": 53.5,
        "weights_peak": 13.9,
        "settling_time": 4.03,
        "rules": 5,
    }
    return {name: value * scale for name, value in overall.items()} | {"error_rms_axes": [1e-4] * 6}


def results_of_a_study():
    both = {"rcafc": {"steady": metrics(1), "whole": metrics(2)}, "rafc": {"steady": metrics(10), "whole": metrics(20)}}
    lasted = {
        "status": "completed",
        "diverged_at": None,
        "simulated_s": 20.0,
        "steady": metrics(1),
        "whole": metrics(1),
        "why": "stable at k_e < 1",
    }
    failed = {"status": "diverged", "diverged_at": 3.295, "steady": None, "whole": metrics(9), "why": "motor lag"}
    table = [f"{name}_{fed}" for name in ("rcafc", "rafc") for fed in ("error", "state")]
    verdicts = ["holds", "holds if d < 103 rad/s", "fails", "open"]
    return {
        "provenance": {"version_undertow": "9.8.7", "scenarios": ["one", "two"]},
        "example1": both,
        "example2": both,
        "table2": {key: lasted | {"steady": metrics(k + 1)} for k, key in enumerate(table)},
        "fidelity": {
            "ideal": {"rcafc": lasted, "rafc": lasted},
            "electromechanical": {"rcafc": failed, "rafc": lasted},
        },
        "claims": [
            {
                "id": f"C{k}",
                "claim": f"Claim number {k} <script>alert(1)</script> & more.",
                "verdict": verdict,
                "evidence": f"rms 0.{k} m/s^2 of `sign`",
                "simulated": f"level ideal, {10 * k} s",
                "scenario": None if verdict == "open" else f"scenarios/c{k:02d}.yaml",
            }
            for k, verdict in enumerate(verdicts, 1)
        ],
    }


@pytest.fixture
def results():
    return results_of_a_study()


@pytest.fixture(scope="session")
def page(runs, tmp_path_factory):
    """The report of the study with two figures: its folder and its text."""
    folder, results = tmp_path_factory.mktemp("report"), results_of_a_study()
    figures = {"fig06": run_figures(Shown(runs["rcafc"]))["tracking"], "fidelity": fidelity_figure(results["fidelity"])}
    written = write_report(results, figures, folder)
    assert written == folder / "report.html"
    return written.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def two_minutes():
    """A made-up replay of two minutes with eight thrusters and five rules on each of six axes."""
    time, corners = np.linspace(0.0, 120.0, 2401), np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]])
    widths = {"position": 3, "attitude": 4, "desired_position": 3, "desired_attitude": 4, "thrust": 8, "error": 2}
    widths |= {"energy": 1, "uncertainty": 6, "estimate": 6, "water": 3, "weights": 30, "firing": 30}
    random = np.random.default_rng(1)
    series = {name: random.normal(size=(len(time), width)) for name, width in widths.items()}
    series["position"] = 2 * np.stack([np.cos(time / 20), np.sin(time / 20), time / 120], axis=-1)
    series["error"] = np.abs(series["error"])
    series["desired_position"] = series["position"] + 0.1
    positions = np.concatenate([corners, corners]) * 0.2
    names = tuple(f"T{number}" for number in range(1, 9))
    thrusters = Thrusters(names, positions, np.tile([0.0, 0.0, 1.0], (8, 1)), np.tile([-40.0, 50.0], (8, 1)))
    return ReplayData("one", "completed", time, np.array([0.5, 0.4, 0.3]), thrusters, True, True, series)
