"""What a run leaves behind, and that its result file repeats it bit for bit."""

import json

import pytest
import xarray as xr
from good_scenario import SCENARIO, SMALL
from ruamel.yaml import YAML

from undertow.analysis.metrics import MEANINGS, PER_AXIS
from undertow.analysis.success import DEFAULT, SATURATED
from undertow.scenario.provenance import checksum, content_hash

pytestmark = pytest.mark.full

NOISY = SCENARIO.replace("seed: 3", "seed: 3\nnavigation: white_noise\nsteady: {start: 0.05, stop: 0.1}")


@pytest.fixture
def ran(undertow, tmp_path, request):
    (tmp_path / "s.yaml").write_text(getattr(request, "param", SMALL))
    said = undertow("simulate", "s.yaml")
    assert said.code == 0, said.err
    return said


@pytest.mark.slow
@pytest.mark.parametrize("ran", [NOISY], indirect=True, ids=["vehicle"])
def test_files_of_a_run(ran, whole_figures, tmp_path):
    folder = tmp_path / "runs" / "s"
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["figures", "metrics.json", "run.html", "run.mcap", "run.nc", "scenario.yaml"]
    assert 'class="replay"' in (folder / "run.html").read_text()
    assert {".png"} == {path.suffix for path in (folder / "figures").iterdir()}
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["status"] == "completed" and metrics["ended"] == pytest.approx(0.1)
    units = ("[axis]", "[axis]/s", "[axis]/s^2")  # of plants whose outputs are neither in m nor in rad
    defined = {name for name, metric in MEANINGS.items() if metric.unit not in units}
    assert set(metrics["whole"]) == {*defined, *PER_AXIS.values()} == set(metrics["steady"])
    assert metrics["success"]["criterion"] == DEFAULT | SATURATED
    resolved = YAML(typ="safe", pure=True).load((folder / "scenario.yaml").read_text())
    assert resolved["controller"]["adaptation"] == 100.0
    with xr.open_dataset(folder / "run.nc") as dataset:
        assert dataset.attrs["content_hash"] == content_hash(dataset)
        assert dataset.attrs["checksum"] == checksum(dataset)
        assert dataset.attrs["seed"] == 3
        assert {"version_jax", "machine", "scenario_hash", "metrics"} <= set(dataset.attrs)
    certificate = metrics["certificate"]
    limits = next(one for one in certificate["hypotheses"] if one["name"] == "limits")
    assert limits["whole"] == limits["steady"] == 1.0 and limits["first_failure"] is None
    assert "no input is at its limit" in ran.out and "V_f of Eq. (46): " in ran.out
    assert all(path.stat().st_size > 5e3 for path in (folder / "figures").iterdir())
    assert (folder / "figures" / "certificate.png").read_bytes().startswith(b"\x89PNG")
    assert "Position error, rms per axis" in ran.out and "It " in ran.out and "Results: runs/s" in ran.out
    assert ran.err.startswith("Advice: torque constant / back-EMF constant is 117")


@pytest.mark.parametrize(
    "ran", [SMALL, pytest.param(NOISY, marks=pytest.mark.slow)], indirect=True, ids=["small", "vehicle"]
)
def test_result_file_repeats_bit_for_bit(ran, undertow, tmp_path):
    said = undertow("simulate", "runs/s/run.nc", "--out", "again")
    assert said.code == 0
    assert "run.nc was repeated bit for bit" in said.out
    with xr.open_dataset(tmp_path / "runs/s/run.nc") as first, xr.open_dataset(tmp_path / "again/run.nc") as second:
        assert first.attrs == second.attrs
        assert first.identical(second)
    assert (tmp_path / "runs/s/scenario.yaml").read_text() == (tmp_path / "again/scenario.yaml").read_text()
    resolved = undertow("simulate", "again/scenario.yaml", "--out", "third")
    assert resolved.code == 0
    with xr.open_dataset(tmp_path / "again/run.nc") as second, xr.open_dataset(tmp_path / "third/run.nc") as third:
        assert second.attrs["content_hash"] == third.attrs["content_hash"]


def changed(tmp_path, change):
    with xr.open_dataset(tmp_path / "runs/s/run.nc") as dataset:
        copy = dataset.load()
    change(copy)
    copy.to_netcdf(tmp_path / "changed.nc", engine="netcdf4")


def other_numbers(dataset):
    dataset["position"].values[3, 0] = 1.0
    dataset.attrs["checksum"] = checksum(dataset)


def test_other_numbers_with_equal_versions_are_a_failure(ran, undertow, tmp_path):
    changed(tmp_path, other_numbers)
    said = undertow("simulate", "changed.nc", "--out", "again")
    assert said.code == 1
    line = "Error: changed.nc was not repeated bit for bit, with the same versions. Differences: position"
    assert said.err.splitlines()[-1] == line


def test_other_numbers_with_other_versions_are_explained(ran, undertow, tmp_path):
    def other(dataset):
        dataset.attrs["version_jax"] = "0.0"
        other_numbers(dataset)

    changed(tmp_path, other)
    said = undertow("simulate", "changed.nc", "--out", "again")
    assert said.code == 0
    assert "changed.nc was not repeated bit for bit; other versions: jax 0.0 then, " in said.out


def test_default_folder_is_one_that_is_free(ran, undertow, tmp_path):
    assert undertow("simulate", "s.yaml").code == 0
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["s", "s-2"]


def test_overwrite(ran, undertow, tmp_path):
    (tmp_path / "runs/s/notes.txt").write_text("mine")
    (tmp_path / "runs/s/metrics.json").write_text("old")
    assert undertow("simulate", "s.yaml", "--out", "runs/s", "--overwrite").code == 0
    assert (tmp_path / "runs/s/metrics.json").read_text() != "old"
    assert (tmp_path / "runs/s/notes.txt").read_text() == "mine"


def test_steady_metrics_are_those_of_the_second_half(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SMALL.replace("steady: {start: 0.05, stop: 0.1}\n", ""))
    assert undertow("simulate", "s.yaml", "--out", "out").code == 0
    metrics = json.loads((tmp_path / "out/metrics.json").read_text())
    assert 0 < metrics["steady"]["position_max"] < metrics["whole"]["position_max"]


def test_continuous_loop_and_late_window(undertow, tmp_path):
    text = SMALL.replace("dt: 1e-3", "kind: continuous").replace("start: 0.05, stop: 0.1", "start: 10, stop: 20")
    text = text.replace("{kind: pid, frequency: 2}", "{kind: rcaf, preset: paper}").replace("navigation:", "# ")
    (tmp_path / "s.yaml").write_text(text)
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == 0
    assert (
        "Advice: there are no steady metrics: the steady window starts at 10 s, and the run ends at 0.1 s" in said.err
    )
    assert json.loads((tmp_path / "out/metrics.json").read_text())["steady"] is None


LAW = """\
import jax.numpy as jnp
from undertow.core.contracts import AbstractController, Model


class Law(AbstractController):
    model: Model

    def init(self, y, r):
        return ()

    def command(self, z, y, r):
        return {input}, {{}}

    def advance(self, z, y, r, u_applied, dt):
        return z

    def signals(self):
        return {{}}


def law(model):
    return Law(model)
"""


@pytest.mark.parametrize(
    ("input", "code", "answer"),
    [
        ("jnp.nan * y.position", 1, "It did not go well: command not finite after 0 s. "),
        ("-r.position", 0, "It did not go well from"),
    ],
)
def test_a_law_that_does_not_control_is_one_to_check(undertow, tmp_path, input, code, answer):
    """A run without a single step has no metrics, not even those of its criterion."""
    (tmp_path / "mine.py").write_text(LAW.format(input=input))
    (tmp_path / "s.yaml").write_text(SMALL.replace("{kind: pid, frequency: 2}", "./mine.py:law"))
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == code and answer in said.out
    assert "undertow check mine.py:law\n" in said.err and (tmp_path / "out" / "run.nc").exists()
