"""A new metric, a new recorded signal: one file each, and everything else follows from what it declares."""

import json

import numpy as np
import pytest
import xarray as xr

from undertow.cli.main import run as command
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import dump, read
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.campaign.task import run_trials

OVERSHOOT = '''
import jax.numpy as jnp
import numpy as np
from undertow.core.metric import AbstractMetric, Metric


class Overshoot(AbstractMetric):
    def metrics(self):
        return {"overshoot": Metric("m", "largest distance beyond the reference"), "never": Metric("s", "not defined")}

    def init(self, signals):
        return jnp.zeros(())

    def update(self, state, t, signals):
        return jnp.maximum(state, -signals["error"].min())

    def values(self, state):
        return {"overshoot": state, "never": np.nan}


def overshoot() -> Overshoot:
    """How far a step goes beyond its end."""
    return Overshoot()
'''

SLIDING = '''
import jax.numpy as jnp
from undertow.core.contracts import AbstractController
from undertow.core.signals import Signal


class Sliding(AbstractController):
    model: object

    def init(self, y, r):
        return ()

    def command(self, z, y, r):
        s = r.velocity - y.velocity + 2.0 * (r.position - y.position)
        return 3.0 * s - 2.0 * y.velocity, {"surface": s, "distance": jnp.abs(s).max()}

    def advance(self, z, y, r, u_applied, dt):
        return z

    def signals(self):
        return {
            "surface": Signal(("axis",), "[axis]/s", "sliding surface"),
            "distance": Signal((), "m/s", "largest distance from it"),
        }


def sliding(model) -> Sliding:
    """A law with a surface."""
    return Sliding(model)
'''

CERTIFIED = (
    SLIDING
    + """

from undertow.analysis.certificate.function import Lyapunov
from undertow.analysis.certificate.hypotheses import Hypothesis
from undertow.analysis.theory import RunCertificate, Theory, register


@register(Sliding)
def theory(law):
    def certificate(run, until_end, window, dt):
        small = until_end["distance"].values < 0.5
        return RunCertificate(
            Lyapunov("s^T s / 2", 0.5 * (run["surface"].values ** 2).sum(-1)),
            [Hypothesis("near", "the surface is near", small)],
            {"nearest": float(until_end["distance"].min())},
        )

    return Theory(certificate=certificate)
"""
)

SCENARIO = {
    "plant": {"kind": "double_integrator", "axes": 2},
    "controller": {"kind": "pid", "frequency": 2.0, "reference_frequency": 0},
    "reference": {"kind": "setpoint", "position": [1.0, 0.5]},
    "initial": {"position": [0.0, 0.0]},
    "loop": {"duration": 4.0, "dt": 0.02, "record": 0.02},
    "steady": {"start": 0.0},
    "metrics": ["./overshoot.py:overshoot"],
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "overshoot.py").write_text(OVERSHOOT)
    (tmp_path / "sliding.py").write_text(SLIDING)
    return tmp_path


def written(folder, **changes):
    path = folder / "s.yaml"
    path.write_text(dump(SCENARIO | changes), encoding="utf-8")
    return path


@pytest.mark.full
def test_a_metric_of_ones_own_in_a_run(folder, capsys):
    command_line = ["simulate", str(written(folder)), "--details", "--out", str(folder / "out"), "--no-prediction"]
    assert command(command_line) == 0
    with xr.open_dataset(folder / "out" / "run.nc") as run:
        beyond = float(-run["error"].values.min())
    found = json.loads((folder / "out" / "metrics.json").read_text())
    assert found["steady"]["overshoot"] == found["whole"]["overshoot"] == pytest.approx(beyond, rel=1e-12)
    assert beyond > 0.05 and "never" not in found["whole"]
    row = next(line for line in capsys.readouterr().out.splitlines() if "overshoot" in line)
    assert row.replace("│", " ").split()[-2:] == ["m", "overshoot"]


@pytest.mark.parametrize(
    "backend", [pytest.param("simd", marks=pytest.mark.full), pytest.param("xla", marks=pytest.mark.slow)]
)
def test_a_metric_of_ones_own_in_a_campaign(folder, backend):
    """A column like every other, and a criterion of success: each trial is what its run is."""
    scenario = SCENARIO | {"loop": SCENARIO["loop"] | {"backend": backend}, "success": {"overshoot": 0.2}}
    text = dump({"scenario": scenario, "trials": 1, "cross": {"controller.frequency": [1.0, 4.0]}})
    found = run_trials(text, str(folder), [0, 1])
    for trial, frequency in enumerate((1.0, 4.0)):
        again = scenario | {
            "controller": {"kind": "pid", "frequency": frequency, "reference_frequency": 0},
            "steady": {"start": 0.0, "stop": 3.99},
        }
        (folder / "one.yaml").write_text(dump(again), encoding="utf-8")
        wanted = run_scenario(read(folder / "one.yaml"))
        assert found["overshoot"][trial] == pytest.approx(wanted.steady["overshoot"], rel=1e-9)
        assert found["success"][trial] == wanted.success.within
    assert np.isnan(found["never"]).all()


def test_a_signal_of_ones_own(folder):
    """Declared by a law in one file: recorded, labelled, with its unit, and kept as a series of a campaign."""
    law = {"kind": "./sliding.py:sliding"}
    run = run_scenario(read(written(folder, controller=law))).dataset
    surface = -run["velocity"] + 2 * run["error"]
    np.testing.assert_allclose(run["surface"], surface, atol=1e-12)
    np.testing.assert_allclose(run["distance"], np.abs(surface.values).max(-1), atol=1e-12)
    assert run["surface"].attrs == {"long_name": "sliding surface", "units": "m/s"}
    assert run["surface"].dims == ("time", "axis") and run["distance"].dims == ("time",)
    asked = {"scenario": SCENARIO | {"controller": law}, "trials": 1, "series": {"signals": ["surface"], "every": 0.02}}
    found = run_trials(dump(asked), str(folder), [0])
    np.testing.assert_allclose(found["series:surface"][0], run["surface"], rtol=1e-9, atol=1e-12)


@pytest.mark.full
def test_a_certificate_of_ones_own(folder, capsys):
    """Registered in the law's own file: in the dataset, metrics.json, on the terminal and as a figure."""
    (folder / "certified.py").write_text(CERTIFIED)
    path = written(folder, controller={"kind": "./certified.py:sliding"})
    assert command(["simulate", str(path), "--details", "--out", str(folder / "out"), "--no-prediction"]) == 0
    with xr.open_dataset(folder / "out" / "run.nc") as run:
        value = 0.5 * (run["surface"].values ** 2).sum(-1)
        np.testing.assert_allclose(run["lyapunov"], value, rtol=1e-15)
        np.testing.assert_allclose(run["lyapunov_rate"][1:], np.diff(value) / np.diff(run["time"]), rtol=1e-12)
        near = float((run["distance"] < 0.5).mean())
    found = json.loads((folder / "out" / "metrics.json").read_text())["certificate"]
    assert found["function"] == "s^T s / 2" and found["start"] == value[0] > found["end"] == value[-1]
    assert found["hypotheses"][0]["name"] == "near" and found["hypotheses"][0]["whole"] == pytest.approx(near)
    assert 0 < near < 1 and found["rising"]["whole"] == 0
    assert "near" in capsys.readouterr().out
    assert (folder / "out" / "figures" / "certificate.png").stat().st_size > 1e4


def test_what_a_law_lacks_is_not_there(folder):
    """No estimate, so neither its error nor a zero in its place; no weights, so no largest one."""
    run = run_scenario(read(written(folder, controller={"kind": "./sliding.py:sliding"})))
    assert not {"estimate", "robust_term", "weights", "modelling_error"} & set(run.dataset)
    lacking = ("estimation_rms", "robust_rms", "model_rms", "weights_peak")
    assert not {f"{group}{name}" for group in ("", "position_", "attitude_") for name in lacking} & set(run.whole)
    assert not {name for name in run.whole if name.startswith("attitude")}
    assert run.whole["position_uncertainty_rms"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            '"surface": s, ',
            "",
            r"`Sliding.signals` declares a signal `surface`, which `Sliding.command` does not give \(sliding.py, line ",
        ),
        (
            '"surface": s',
            '"surf": s',
            "`Sliding.command` gives a signal `surf`, which `Sliding.signals` does not declare",
        ),
        ('"surface"', '"error"', "`controller.signals.error` must be the name of one signal only"),
    ],
)
def test_declared_and_given_must_agree(folder, old, new, said):
    (folder / "sliding.py").write_text(SLIDING.replace(old, new))
    with pytest.raises(BadInput, match=said):
        run_scenario(read(written(folder, controller={"kind": "./sliding.py:sliding"})))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"success": {"overshot": 0.2}}, r"`success.overshot` must be a metric.*Did you mean `overshoot`\?"),
        ({"success": {"attitude_rms": 0.2}}, "`success.attitude_rms` must be a metric of this plant"),
        ({"metrics": ["overshoot"]}, r"`metrics\[0\]` must be .*\./file.py:function"),
        ({"metrics": ["./sliding.py:sliding"]}, r"`metrics\[0\]"),
        ({"metrics": ["./overshoot.py:overshoot"] * 2}, "second `overshoot`"),
    ],
)
def test_what_is_wrong_is_told(folder, changes, said):
    with pytest.raises(BadInput, match=said):
        build(read(written(folder, **changes)))
