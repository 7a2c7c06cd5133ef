"""What a campaign leaves: rows, page, summary and scenarios of the worst trials."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from command import contents

from undertow.cli.main import run
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.campaign.task import task_context

pytestmark = pytest.mark.full

CROSS = {"controller.frequency": {"calm": 2.0, "wild": 500.0}, "plant": [{"kind": "double_integrator", "limit": 1e30}]}


def test_what_it_leaves(campaign_file, whole_figures, tmp_path, capsys):
    path, out = campaign_file(trials=20, cross=CROSS, description="Two PIDs"), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 1  # some failed
    said = capsys.readouterr()
    assert "20 of 40 trials completed (20 diverged)" in said.out and said.err == ""
    assert "(controller.frequency wild, plant double_integrator) is violated: 0 % of the trials keep it" in said.out
    found = json.loads((out / "summary.json").read_text())
    calm, wild = found["combinations"]
    assert found["status"] == {"completed": 20, "diverged": 20}
    assert (calm["failed"], wild["failed"]) == (0, 20)
    assert calm["values"]["controller.frequency"] == "calm"
    assert calm["requirements"][0]["verdict"] != "fails" and wild["requirements"][0]["verdict"] == "fails"
    assert found["sensitivity"]["disturbance.amplitude"]["position_rms"] > 0.99
    page = re.sub(r"<[^>]+>", " ", (out / "campaign.html").read_text())
    assert "seed 7" in page and "uniform, 0.5 to 2" in page
    for words in ("Two PIDs", "Status of the trials", "Requirements", "The worst trials", "0.0 % [0.0"):
        assert words in page
    assert {file.name for file in (out / "figures").glob("*.svg")} == {"distributions.svg", "sensitivity.svg"}
    worst = sorted((out / "worst").iterdir())
    assert len(worst) == 5 and all(int(file.stem.split("-")[1]) % 2 == 1 for file in worst)  # of the wild ones
    assert run(["simulate", str(worst[0]), "--no-prediction", "--out", str(tmp_path / "again")]) == 1
    assert "diverged" in capsys.readouterr().out.lower()
    assert run(["campaign", "status", str(out)]) == 0
    assert "40 of 40 trials done" in capsys.readouterr().out


def test_variants_are_an_axis_of_the_results(campaign_file, tmp_path, capsys):
    """The same trials as by `cross`, where a variant changes one key only."""
    changed = {"slow": 1.0, "brisk": 4.0}
    ways = (
        {"variants": {name: {"controller.frequency": w} for name, w in changed.items()}},
        {"cross": {"controller.frequency": changed}},
    )
    rows = []
    for i, way in enumerate(ways):
        out = tmp_path / str(i)
        assert run(["campaign", str(campaign_file(str(i), trials=4, **way)), "--out", str(out)]) == 0
        rows.append(xr.open_zarr(out / STORE, consolidated=False).load())
    assert rows[0]["variant"].values.tolist() == ["slow", "brisk"]
    np.testing.assert_array_equal(rows[0]["position_rms"].values, rows[1]["position_rms"].values)
    found = json.loads((tmp_path / "0" / "summary.json").read_text())
    assert [one["values"] for one in found["combinations"]] == [{"variant": "slow"}, {"variant": "brisk"}]
    assert "slow" in capsys.readouterr().out
    assert run(["campaign", str(tmp_path / "0.yaml"), "--out", str(tmp_path / "0"), "--resume"]) == 0


def test_rows_stand_by_what_is_crossed_and_drawn(campaign_file, tmp_path):
    """By names where there are such, by numbers elsewhere; `trial` is the number that its own scenario file has."""
    cross = {"plant.limit": [10.0, 20.0], "controller.frequency": {"calm": 1.0, "brisk": 2.0}}
    cross |= {"controller.feedforward": [True, False]}
    path, out = campaign_file(cross=cross, trials=5), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    rows = xr.open_zarr(out / STORE, consolidated=False).load()
    assert rows["position_rms"].sizes == {key: 2 for key in cross} | {"sample": 5}
    several = prepare(path).trials
    for number in rows["trial"].values.flat:
        (place,) = np.argwhere(rows["trial"].values == number)
        row = rows.isel(dict(zip(rows["trial"].dims, place, strict=True)))
        values = several.values(int(number))
        for key in ("plant.limit", "controller.feedforward"):
            assert row[key] == values[key]
        assert cross["controller.frequency"][str(row["controller.frequency"].values)] == values["controller.frequency"]
        assert float(row["vary:disturbance.amplitude"]) == values["disturbance.amplitude"]
        assert int(row["seed"]) == several.seed(int(number))
    errors = rows["position_rms"].sel({"controller.frequency": ["calm", "brisk"]})
    assert (errors.diff("controller.frequency") < 0).all()  # pair by pair, as both meet the same samples
    found = json.loads((out / "summary.json").read_text())["combinations"]
    for one in found:
        limit, frequency, feedforward = one["values"].values()
        own = errors.sel({"plant.limit": float(limit), "controller.feedforward": feedforward == "True"})
        middle = own.sel({"controller.frequency": frequency}).median("sample")
        assert one["metrics"]["position_rms"]["0.5"] == float(middle)


@pytest.mark.parametrize(
    "duration", [pytest.param(2.0, marks=pytest.mark.slow), 2.06]
)  # ends at a record, and between two
def test_the_worst_trials_are_repeated_bit_for_bit(campaign, campaign_file, tmp_path, duration):
    """Metrics and series of a scenario file from `worst/`, run alone, are those of the lane that it flew in."""
    out, scenario = tmp_path / "out", campaign()["scenario"]
    scenario["loop"]["duration"] = duration
    path = campaign_file(scenario=scenario, series={"signals": ["position", "input"], "every": 0.1})
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    rows = xr.open_zarr(out / "trials.zarr", consolidated=False).load()
    for file in sorted((out / "worst").iterdir())[:2]:
        trial, again = int(file.stem.split("-")[1]), tmp_path / file.stem
        assert run(["simulate", str(file), "--no-prediction", "--out", str(again)]) == 0
        found = json.loads((again / "metrics.json").read_text())
        steady = found["steady"]
        assert found["ended"] == float(rows["ended"][trial]) == duration
        assert found["success"]["within"] == bool(rows["success"][trial])
        for name in json.loads(rows.attrs["metrics"]):
            kept = float(rows[name][trial])  # NaN where a metric is not defined: the goal is where it starts
            assert (name not in steady) if np.isnan(kept) else steady[name] == kept, name
        assert "settling_time" not in steady
        series = xr.open_dataset(again / "run.nc")
        for name in ("position", "input"):
            np.testing.assert_array_equal(series[name].values, rows[f"series:{name}"][trial].values)
            assert rows[f"series:{name}"].dims[1:] == series[name].dims
        for name in ("time", "axis", "actuator"):
            np.testing.assert_array_equal(rows[name].values, series[name].values)


def test_trials_that_cannot_be_built_are_neither_worst_nor_a_failure_of_the_law(campaign_file, tmp_path, capsys):
    """A frequency below zero is no controller: trials with one are counted apart."""
    path, out = (
        campaign_file(trials=12, vary={"controller.frequency": {"uniform": [-1.0, 2.0]}}, seed=5),
        tmp_path / "out",
    )
    assert run(["campaign", str(path), "--out", str(out)]) == 1
    found = json.loads((out / "summary.json").read_text())
    rows = xr.open_zarr(out / STORE, consolidated=False).load()
    ran = rows["status"].values == 0
    assert 0 < found["status"]["invalid"] == (~ran).sum() < 7
    assert ran[found["worst"]].all() and len(found["worst"]) == 5
    share = (rows["position_rms"].values[ran] < 0.2).mean()
    assert found["combinations"][0]["requirements"][0]["kept"] == pytest.approx(share)
    first = int(np.argmin(ran))
    (invalid,) = found["invalid"]
    assert invalid["trials"] == (~ran).sum()
    assert re.fullmatch(rf"`controller.frequency` must be positive, .*, line 13, trial {first}\)", invalid["why"])
    assert invalid["why"] in capsys.readouterr().out


def test_other_requirements_need_no_flight(campaign_file, tmp_path, capsys):
    """The rows stay as they are, and the summary says what is required now."""
    out = tmp_path / "out"
    verdict = lambda: json.loads((out / "summary.json").read_text())["combinations"][0]["requirements"][0]["verdict"]
    assert run(["campaign", str(campaign_file()), "--out", str(out)]) == 0
    before = contents(out)
    stricter = campaign_file("stricter", requirements={"position_rms": {"below": 1e-6, "share": 0.5}})
    assert run(["campaign", str(stricter), "--out", str(out), "--resume"]) == 0
    after = contents(out)
    assert verdict() == "fails"
    assert {name for name in after if before.get(name) != after[name]} == {"zarr.json"}
    assert run(["campaign", str(campaign_file()), "--out", str(out), "--resume"]) == 0
    assert verdict() == "holds" and contents(out) == before


def test_what_is_drawn_from_words_is_told_apart(campaign_file, tmp_path):
    """By choice: as many trials as drew it, and the quantiles of those."""
    path = campaign_file(vary={"navigation": {"choice": ["perfect", {"kind": "white_noise", "velocity": 0.5}]}}, seed=3)
    out = tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    found = json.loads((out / "summary.json").read_text())["choices"]["navigation"]
    rows = xr.open_zarr(out / STORE, consolidated=False).load()
    for number, one in enumerate(found.values()):
        chosen = rows["position_rms"].values[rows["vary:navigation"].values == number]
        assert one["trials"] == len(chosen) > 5
        assert one["metrics"]["position_rms"]["0.5"] == np.median(chosen)
    assert list(found) == rows["vary:navigation"].attrs["choices"]


def test_a_file_that_the_scenario_names_belongs_to_the_campaign(campaign, campaign_file, tmp_path, capsys):
    """Its worst trials stand alone, and another content of it makes another campaign."""
    rows = "t,d1\n0,0.5\n1,{}\n2,0.5\n"
    (tmp_path / "d.csv").write_text(rows.format(1.0))
    scenario = campaign()["scenario"] | {"disturbance": {"kind": "table", "file": "d.csv"}}
    vary = {"controller.frequency": {"uniform": [1.5, 2.5]}}
    path, out = campaign_file(scenario=scenario, vary=vary, trials=6, requirements={}), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    worst = sorted((out / "worst").iterdir())[0]
    trial = int(worst.stem.split("-")[1])
    assert run(["simulate", str(worst), "--no-prediction", "--out", str(tmp_path / "again")]) == 0
    found = json.loads((tmp_path / "again" / "metrics.json").read_text())["steady"]["position_rms"]
    assert found == float(xr.open_zarr(out / STORE, consolidated=False)["position_rms"][trial])
    (tmp_path / "d.csv").write_text(rows.format(2.0))
    task_context.cache_clear()  # as in a process that begins
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
    assert "a file that the scenario names had other contents" in capsys.readouterr().err


@pytest.mark.parametrize("section", ["cross", "vary"])
def test_every_file_that_trials_name_belongs_to_the_campaign(campaign_file, tmp_path, capsys, section):
    """Also one that the first trials do not use."""
    tables, rows = [f"{name}.csv" for name in "abc"], "t,d1\n0,{0}\n2,{0}\n"
    for name in tables:
        (tmp_path / name).write_text(rows.format(1.0))
    parts = [{"kind": "table", "file": name} for name in tables]
    differing = (
        {"vary": {}, "cross": {"disturbance": parts}}
        if section == "cross"
        else {"vary": {"disturbance": {"choice": parts}}}
    )
    path, out = campaign_file(trials=2, **differing), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    for name in tables:
        (tmp_path / name).write_text(rows.format(2.0))
        task_context.cache_clear()  # as in a process that begins
        assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
        assert "a file that the scenario names had other contents" in capsys.readouterr().err
        (tmp_path / name).write_text(rows.format(1.0))
    task_context.cache_clear()
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 0


@pytest.mark.parametrize("backend, number", [("simd", 0), ("xla", 4)])
def test_what_flew_is_told(campaign, campaign_file, tmp_path, capsys, backend, number):
    scenario, out = campaign()["scenario"], tmp_path / "out"
    scenario["loop"]["backend"] = backend
    assert run(["campaign", str(campaign_file(scenario=scenario, trials=4, requirements={})), "--out", str(out)]) == 0
    sentence = f"{number} trials used the XLA backend, which is slower"
    assert (sentence in capsys.readouterr().out) == (sentence in (out / "campaign.html").read_text()) == bool(number)
    column = xr.open_zarr(out / STORE, consolidated=False)["backend"]
    assert column.attrs["flag_meanings"].split()[int(column[0])] == backend
