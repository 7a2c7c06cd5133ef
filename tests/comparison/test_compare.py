"""`undertow compare` and `ut.compare` on one axis: what they find and what they leave."""

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

sys.path.append(str(Path(__file__).parents[1] / "docs"))
from test_blocks import FILE, ROOT, blocks

import undertow as ut
from undertow.cli import compare
from undertow.cli.main import run
from undertow.scenario.reading import dump
from undertow.studies.comparison.prepare import prepare_comparison

pytestmark = pytest.mark.full

WILD = {"kind": "pid", "frequency": 500.0}


@pytest.fixture
def own_law(scenario):
    """The controller of docs/how-to/your-own-controller.md in the current folder."""
    page = ROOT / "docs" / "how-to" / "your-own-controller.md"
    (code,) = [
        block.code for block in blocks(page) if (at := FILE.match(block.code)) and at["name"] == "my_controller.py"
    ]
    Path("mine.py").write_text(code.replace("def my_controller(", "def smc("))


def test_command(scenario, own_law, capsys):
    """A law beside itself, a diverging one and one of a file: numbers, failures, and every file that is left."""
    path, wild = scenario(), scenario("wild", controller=WILD)
    given = f"scenario,again=scenario,{wild},./mine.py:smc"
    assert (
        run(["compare", path, "--controllers", given, "--trials", "8", "--out", "out", "--details"]) == 1
    )  # some failed
    said = capsys.readouterr()
    assert "Advice: " in said.err and "smc" in said.err
    out, names = Path("out"), ["pid (scenario)", "again", "pid (wild)", "smc"]
    found = json.loads((out / "comparison.json").read_text())
    assert found["names"] == names and found["trials"] == 8
    assert found["endings"]["pid (wild)"] == {"diverged": 8} and found["endings"]["smc"] == {"completed": 8}
    assert "pid (wild) did not complete 8 of 8 trials (diverged 8, median time" in said.out
    of = {(one["candidate"], one["baseline"], one["metric"]): one for one in found["differences"]}
    beside_itself = [one for key, one in of.items() if key[:2] == ("again", "pid (scenario)")]
    assert all(one["pairs"] == 8 and one["median"] == one["smaller"] == one["larger"] == 0 for one in beside_itself)
    assert "again against pid (scenario) (8 pairs): all differences are zero." in said.out
    assert of["pid (wild)", "again", "position_rms"]["pairs"] == 0
    assert "pid (wild) against again: there is no trial that both completed." in said.out

    rows = xr.open_zarr(out / "trials.zarr", consolidated=False).load()
    errors = rows["position_rms"].values
    apart = errors[3] - errors[0]
    assert of["smc", "pid (scenario)", "position_rms"]["median"] == np.median(apart)
    assert len(np.unique(rows["seed"].values[0])) == 8 and (rows["seed"].values == rows["seed"].values[0]).all()
    table = list(csv.DictReader((out / "comparison.csv").read_text().splitlines()))
    assert {row["candidate"] for row in table} == set(names[1:])
    assert "\\toprule" in (out / "comparison.tex").read_text() and "| smc |" in (out / "comparison.md").read_text()
    page = re.sub(r"<[^>]+>", " ", (out / "comparison.html").read_text())
    for words in ("Comparison: pid (scenario), again", "default gains of", "axis.yaml", "Holm", "diverged"):
        assert words in page


def test_a_law_that_was_edited_is_compared_as_it_is_now(scenario, own_law):
    """As in a notebook: the text of the comparison is the same, and the file that it names has other contents."""
    file = Path("mine.py")
    errors = []
    for slope in ("2.0", "4.0", "2.0"):
        file.write_text(re.sub(r"slope=[\d.]+", f"slope={slope}", file.read_text()))
        with pytest.warns(UserWarning, match="smc is not tuned"):
            comparison = ut.compare(scenario(), {"smc": "./mine.py:smc", "pid": "pid"}, trials=1)
        errors.append(comparison.dataset["position_rms"].sel(controller="smc").item())
    assert errors[0] == errors[2] != errors[1]


@pytest.mark.slow
def test_figures_repetition_and_further_trials(scenario, own_law, whole_figures, capsys):
    path, out = scenario(), Path("out")
    given = ["compare", path, "--controllers", "scenario,./mine.py:smc", "--out", "out"]
    assert run([*given, "--trials", "8"]) == 0
    assert {one.stem for one in (out / "figures").glob("*.svg")} == {
        "differences",
        "pareto",
        "histories",
        "distributions",
    }
    errors = xr.open_zarr(out / "trials.zarr", consolidated=False).load()["position_rms"].values
    assert run(["simulate", "out/scenarios/2-smc.yaml", "--no-prediction", "--out", "one"]) == 0
    metrics = json.loads(Path("one/metrics.json").read_text())["steady"]
    assert metrics["position_rms"] == errors[1, 0]  # bit for bit
    assert run([*given, "--trials", "9"]) == 2
    assert "Add --resume to continue it, or --overwrite to replace it" in capsys.readouterr().err
    assert run([*given, "--trials", "9", "--resume"]) == 0
    assert json.loads((out / "comparison.json").read_text())["trials"] == 9


def test_from_python(scenario):
    """A slower loop has the larger error, and less chattering; the same numbers as the store of the campaign."""
    with pytest.warns(UserWarning, match="slow, quick are not tuned"):
        found = ut.compare(
            scenario(), {"slow": {"kind": "pid", "frequency": 1}, "quick": {"kind": "pid", "frequency": 3}}, trials=8
        )
    assert isinstance(found, ut.Comparison)
    assert found.dataset["position_rms"].dims == ("controller", "sample")
    slow, quick = (found.dataset["position_rms"].sel(controller=name).values for name in ("slow", "quick"))
    assert (slow > quick).all()
    (one,) = [one for one in found.differences if one.metric == "position_rms"]
    assert (one.candidate, one.baseline, one.smaller) == ("quick", "slow", 8) and one.established
    assert one.median == np.median(quick - slow) and one.low <= one.median <= one.high < 0
    (variation,) = [one for one in found.differences if one.metric == "input_variation"]
    assert variation.larger == 8
    assert "quick against slow (8 pairs): smaller position error rms per axis" in repr(found)
    assert "slow & quick" in found.table("latex")
    shown = found._repr_html_()
    assert "Comparison: slow, quick" in shown and "The position error rms per axis of quick is smaller" in shown
    with pytest.raises(ut.BadInput, match="`style` must be one of markdown, latex, csv"):
        found.table("word")


def interrupted(*arguments):
    raise KeyboardInterrupt


def test_nothing_random(scenario, capsys, monkeypatch):
    """One trial and no interval; equal scenarios differ in nothing. Stopped in a replay, it says how to continue."""
    path = scenario(navigation="perfect")
    assert run(["compare", path, scenario("copy", navigation="perfect"), "--out", "out", "--details"]) == 0
    said = capsys.readouterr()
    assert "Advice: nothing in the scenario is random" in said.err
    assert "copy against axis (1 pair): all differences are zero." in said.out
    found = json.loads(Path("out/comparison.json").read_text())
    assert found["trials"] == 1 and found["all_equal"] and found["dimension"] == "scenario"
    assert {one["low"] for one in found["differences"]} == {None}
    with monkeypatch.context() as patched:
        patched.setattr(compare, "check_replay", lambda built: None)
        patched.setattr(compare, "run_again", interrupted)
        assert run(["compare", path, "copy.yaml", "--out", "out", "--resume", "--replay"]) == 130
    again = f"To continue: undertow compare {path} copy.yaml --replay --out out --resume\n"
    assert capsys.readouterr().err.endswith(f"Stopped: 2 of 2 trials are in out. {again}")
    assert run(["compare", path, "copy.yaml", "--out", "out", "--resume", "--replay"]) == 2
    line = "`--replay` must be left out for a plant that is no vehicle with thrusters, but is given"
    assert line in capsys.readouterr().err


def test_scenarios_as_a_whole(scenario, capsys):
    """What differs is said; another folder's relative names stay its own."""
    path = scenario()
    Path("other").mkdir()
    Path("other/axis.yaml").write_text(Path(path).read_text().replace("frequency: 2.0", "frequency: 3.0"))
    assert run(["compare", path, "other/axis.yaml", "--trials", "6", "--out", "out", "--details"]) == 0
    found = json.loads(Path("out/comparison.json").read_text())
    assert found["names"][1] == "other/axis"
    assert found["differing"] == {"controller": ["pid frequency=2.0", "pid frequency=3.0"]}
    (one,) = [one for one in found["differences"] if one["metric"] == "position_rms"]
    assert one["smaller"] == 6
    assert "frequency 3.0), not tuned" in capsys.readouterr().out


def test_campaign_file(scenario, capsys):
    """Its samples are used for every candidate, and its only axis may be what is compared."""
    varied = {"scenario": scenario(navigation="perfect"), "trials": 6, "seed": 4}
    varied["vary"] = {"disturbance.amplitude": {"uniform": [0.5, 2.0]}}
    swept = varied | {"cross": {"controller.frequency": [1.0, 2.0]}}
    Path("varied.yaml").write_text(dump(varied))
    Path("swept.yaml").write_text(dump(swept))
    Path("slow.yaml").write_text(Path("axis.yaml").read_text().replace("frequency: 2.0", "frequency: 1.0"))
    assert run(["compare", "varied.yaml", "--controllers", "slow.yaml,scenario", "--out", "one"]) == 0
    found = json.loads(Path("one/comparison.json").read_text())
    assert found["names"] == ["pid (slow)", "pid (scenario)"] and found["differences"][0]["smaller"] == 6
    rows = xr.open_zarr("one/trials.zarr", consolidated=False).load()["vary:disturbance.amplitude"].values
    assert (rows[0] == rows[1]).all() and np.ptp(rows[0]) > 0.1
    ready = prepare_comparison([Path("swept.yaml")])
    assert (ready.dimension, ready.names, ready.campaign.trials) == ("controller.frequency", ("1.0", "2.0"), 6)
    assert "axis.yaml" not in ready.notes[0].sentence and "frequency 1.0" in ready.notes[0].sentence
    capsys.readouterr()
    assert run(["compare", "swept.yaml", "--controllers", "pid,adrc", "--out", "three"]) == 2
    assert "Leave out --controllers to compare controller.frequency of the file" in capsys.readouterr().err
