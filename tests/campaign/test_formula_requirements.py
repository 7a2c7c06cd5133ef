"""Temporal formulas as requirements of a campaign: robustness of every trial, verdict, resuming, bad input."""

import json

import numpy as np
import pytest
import xarray as xr

from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.trials import Trials

FORMULA = "within 4 s always abs(error) < 0.3"
CAMPAIGN = f"""\
scenario:
  plant: {{kind: double_integrator, axes: 1, limit: 20}}
  controller: {{kind: pid, frequency: 2}}
  reference: {{kind: setpoint, position: [1]}}
  disturbance: {{kind: sinusoid, amplitude: 0.2}}
  loop: {{duration: 8, dt: 0.02, record: 0.1}}
trials: 40
vary:
  disturbance.amplitude: {{uniform: [0.2, 2.0]}}
requirements:
  settles: {{formula: "{FORMULA}", share: 0.3}}
  position_rms: {{below: 0.4}}
"""


@pytest.fixture
def campaign(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "c.yaml"
    path.write_text(CAMPAIGN)
    return path


@pytest.mark.full
def test_robustness_is_that_of_single_runs(campaign, tmp_path):
    assert run(["campaign", "c.yaml", "--out", "out"]) == 0
    rows = xr.open_zarr(tmp_path / "out" / "trials.zarr", consolidated=False).load()
    several: Trials = prepare(campaign).trials
    for trial in (0, 17, 39):
        data = several.data(trial) | {"requirements": {"settles": {"formula": FORMULA}}}
        alone = run_scenario(from_data(data)).facts.requirements["settles"].robustness
        assert rows["settles"].values[rows["trial"].values == trial] == alone
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["combinations"][0]["requirements"]
    assert [one["formula"] for one in found] == [FORMULA, None]
    assert found[0]["kept"] == float((rows["settles"] > 0).mean()) and 0 < found[0]["kept"] < 1
    page = (tmp_path / "out" / "campaign.html").read_text()
    assert "within 4 s always abs(error)" in page


@pytest.mark.full
def test_another_formula_is_another_campaign(campaign, capsys):
    assert run(["campaign", "c.yaml", "--out", "out"]) == 0
    campaign.write_text(CAMPAIGN.replace("below: 0.4", "below: 0.5"))
    assert run(["campaign", "c.yaml", "--out", "out", "--resume"]) == 0
    campaign.write_text(CAMPAIGN.replace("within 4 s", "within 5 s"))
    assert run(["campaign", "c.yaml", "--out", "out", "--resume"]) == 2
    assert "`requirements.settles` was" in capsys.readouterr().err


@pytest.mark.full
def test_series_beside_formulas(campaign, tmp_path):
    campaign.write_text(CAMPAIGN + "series: {signals: [position], every: 0.1}\n")
    assert run(["campaign", "c.yaml", "--out", "out"]) == 0
    rows = xr.open_zarr(tmp_path / "out" / "trials.zarr", consolidated=False).load()
    assert [name for name in rows if str(name).startswith("series:")] == ["series:position"]
    late = np.abs(1 - rows["series:position"].isel(axis=0)).where(rows["time"] >= 4 - 1e-9, drop=True).max("time")
    np.testing.assert_allclose(rows["settles"], (0.3 - late) / 0.3, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("abs(error)", "abs(eror)", r"`requirements.settles.formula` must name signals of the run, but is `eror`"),
        pytest.param("settles:", "input_rms:", r"must have another name than a metric", marks=pytest.mark.full),
        (", share: 0.3", ", below: 1", r"must have one of below, formula"),
        ("requirements:", "series: {signals: [position], every: 0.2}\nrequirements:", r"be the time between records"),
        pytest.param(
            "disturbance.amplitude: {uniform",
            "loop.duration: {uniform",
            r"one length and one rate",
            marks=pytest.mark.full,
        ),
    ],
)
def test_bad_formulas(campaign, old, new, said):
    assert old in CAMPAIGN
    campaign.write_text(CAMPAIGN.replace(old, new))
    with pytest.raises(BadInput, match=said):
        prepare(campaign)
