"""Mistakes in a campaign file or on the command line: one line each, and nothing is lost."""

import importlib.util
import json
import re
from pathlib import Path

import pytest
from command import VEHICLE, contents

from undertow.cli.main import run
from undertow.core.file_lock import file_lock
from undertow.scenario.reading import dump
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.run_campaign import STORE, run_campaign


@pytest.fixture(scope="module")
def campaign_folder(tmp_path_factory):
    """One for all tests, so that the campaign of four trials is compiled once."""
    return tmp_path_factory.mktemp("campaigns")


@pytest.mark.full
@pytest.mark.parametrize(
    "changes, said",
    [
        (
            {"trails": 3},
            r"`trails` must be a key of the campaign, but is unknown \(small.yaml, line \d+\). Did you mean `trials`\?",
        ),
        ({"scenario": "no.yaml"}, r"`scenario` must be an existing file, but is .*no.yaml"),
        (
            {"vary": {"controller.freq": {"uniform": [1.0, 2.0]}}},
            r"`controller.freq` must be an option here, but is unknown \(small.yaml, line 13, trial 0\)",
        ),
        ({"cross": {"loop.dt": []}}, r"`cross.loop.dt` must have an entry"),
        ({"trials": 0}, r"`trials` must be greater than or equal to 1, but is 0"),
        ({"series": {"signals": ["positon"]}}, r"`series.signals\[0\]` must be one of .*position.*, but is positon"),
        (
            {"requirements": {"tracking": {"below": 1.0}}},
            r"`requirements.tracking` must be a metric, but is unknown .*, line 16\). Known: ",
        ),
        (
            {"vary": {"": {"uniform": [1.0, 2.0]}}},
            r"`vary` must be a key path such as plant.vehicle.mass .*, but is ''",
        ),
        ({"vary": {"controller..gain]": {"uniform": [1.0, 2.0]}}}, r"`vary` must be a key path .*'controller..gain\]'"),
        (
            {"vary": {"disturbance[0].amplitude": {"uniform": [1.0, 2.0]}}},
            r"`disturbance\[0\].amplitude` must name an entry of a list only where there is a list, but is \[0\] of kind",
        ),
        (
            {"vary": {"disturbance.amplitude": {"uniform": [3.0]}}},
            r"`vary.disturbance.amplitude.uniform` must have at least 2 entries, but is \[3.0\]",
        ),
        (
            {"requirements": {"position_rms": 0.1}},
            r"`requirements.position_rms` must be a mapping of keys to values, but is 0.1",
        ),
        (
            {"series": {"every": 0.1}, "vary": {"loop.duration": {"uniform": [1.0, 2.0]}}},
            r"`series` must be of runs of one length and sampling time, but is given together with loop.duration",
        ),
        (
            {"vary": {"plant.limit": {"unifrom": [1.0, 2.0]}}},
            r"`vary.plant.limit.unifrom` must be a key of the campaign, .*line 14\). Did you mean `uniform`\?",
        ),
        (
            {"requirements": {"position_rms": {"below": 1.0, "sahre": 0.5}}},
            r"`requirements.position_rms.sahre` must be .* Did you mean `share`\?",
        ),
        ({"series": {"evry": 1.0}}, r"`series.evry` must be .* Did you mean `every`\?"),
        (
            {"vary": {"controller.frequency": {"uniform": [-2.0, -1.0]}}},  # none of the first trials can be built
            r"`controller.frequency` must be positive, but is -1.\d+ \(small.yaml, line 13, trial 0\)",
        ),
        (
            {"vary": {}, "scenario": {"reference": "setpont"}},
            r"`reference` .* \(small.yaml, line 1, trial 0\). Did you mean `setpoint`",
        ),
        (
            {
                "series": {"every": 0.1},
                "cross": {"plant.vehicle": ["odin", "bluerov2"]},
                "vary": {},
                "scenario": VEHICLE,
            },
            r"`series` must be of plants with the same outputs and inputs, but is of several",
        ),
        (
            {"cross": {"seed": [1, 2]}},
            r"`cross.seed` must be left out \(small.yaml, line \d+\). Every trial has its own seed",
        ),
        (
            {"vary": {"navigation.velocity": {"uniform": [0.0, 1.0]}, "navigation": {"choice": ["perfect"]}}},
            r"`navigation.velocity` must not be given together with navigation, which contains it",
        ),
        (
            {"requirements": {"position_rms": {"below": 1.0, "share": 1.0}}},
            r"`requirements.position_rms.share` must be less than 1, .*; 0.99, for example, but is 1.0",
        ),
        ({"cross": {"loop.dt": [0.02, 0.02]}}, r"`cross.loop.dt` must have entries that differ, but is twice 0.02"),
        (
            {"cross": {"loop.dt": {"choice": [0.02, 0.04]}}},
            r"`cross.loop.dt` must be a list, or values by names, but is choice alone .*write `loop.dt: \[first, second\]`",
        ),
        (
            {"vary": {"disturbence[0].amplitude": {"uniform": [1.0, 2.0]}}},
            r"must name an entry of a list of the scenario, which has no `disturbence` there .* Did you mean `disturbance`\?",
        ),
        (
            {"vary": {"initial.position[0]": {"uniform": [1.0, 2.0]}}},
            r"which has no `position` there .*Give `position` there, with all its entries",
        ),
        (
            {"vary": {"disturbance.0.amplitude": {"uniform": [1.0, 2.0]}}},
            r"`vary` must be a key path such as .* or initial.position\[0\], but is 'disturbance.0.amplitude'",
        ),
        (
            {"vary": {"scenario.disturbance.amplitude": {"uniform": [1.0, 2.0]}}},
            r"must start inside the scenario .*Write `disturbance.amplitude`",
        ),
        (
            {"scenario": "small.yaml"},
            r"`scenario` must be the file of a scenario, but is small.yaml, a campaign \(small",
        ),
        ({"cross": {"loop.dt": [1, 1.0]}}, r"`cross.loop.dt` must have entries that differ, but is twice 1.0"),
        ({"cross": {"loop.dt": 0.02}}, r"`cross` must have a list of values for `loop.dt`, or values by names, but is"),
        ({"series": {"signals": ["error", "error"]}}, r"`series.signals` must name every signal once, but is"),
        ({"scenario": 3}, r"`scenario` must be the name of a file, or a mapping of keys to values, but is 3"),
        ({"series": {"every": 0.03}}, r"`series.every` must be a whole number of sampling times \(0.02 s\)"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(campaign_file, tmp_path, capsys, changes, said):
    path = campaign_file(**changes)
    assert run(["campaign", str(path), "--out", str(tmp_path / "out")]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and re.search(said, complaint), complaint
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments, said",
    [
        (
            ["campaign", "scenario.yaml"],
            r"`scenario.yaml` must be a campaign, but is a scenario. Run it: undertow simulate scenario.yaml",
        ),
        (
            ["simulate", "campaign.yaml"],
            r"`campaign.yaml` must be a scenario, but is a campaign. Run it: undertow campaign campaign.yaml",
        ),
        (["campaign", "campaign.yaml", "out"], r"`DIR` must follow the word `status`, but is out. .*`--out out`"),
        (["campaign", "status", "out", "--resume"], r"`--resume` must be left out with `status`"),
        (["campaign", "campaign.yaml", "--resume", "--overwrite"], r"`--resume` must be without --overwrite"),
        pytest.param(
            ["check", "campaign.yaml", "--option", "seed=1"],
            r"`--option` must be left out for a campaign, but is seed=1",
            marks=pytest.mark.full,
        ),
        (
            ["campaign", "campaign.yaml", "--out", "/proc/out"],
            r"`--out` must be a folder that can be made and written, but is /proc/out, where nothing can",
        ),
    ],
)
def test_a_mistake_on_the_command_line(campaign, tmp_path, capsys, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    Path("campaign.yaml").write_text(dump(campaign()))
    Path("scenario.yaml").write_text(dump(campaign()["scenario"]))
    assert run(arguments) in (2, 4)
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and re.search(said, complaint), complaint
    assert {file.name for file in tmp_path.iterdir()} == {"campaign.yaml", "scenario.yaml"}


@pytest.mark.parametrize(
    "cluster, said",
    [
        ("slurm", r"`--cluster` must find a SLURM that answers, but is sinfo: no configuration"),
        ("ssh", r"`UNDERTOW_HOSTS` must name the hosts, separated by commas, but is not set"),
        ("pbs", r"`--cluster` must be one of local, slurm, ssh, or an address such as tcp://10.0.0.1:8786, but is pbs"),
        ("Local", r"but is Local. Did you mean `local`\?"),
    ],
)
def test_a_cluster_that_is_not_there_is_told(campaign_file, tmp_path, capsys, monkeypatch, cluster, said):
    (tmp_path / "sinfo").write_text("#!/bin/sh\necho 'sinfo: no configuration' >&2; exit 1\n")
    (tmp_path / "sinfo").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("UNDERTOW_HOSTS", raising=False)
    assert run(["campaign", str(campaign_file()), "--out", str(tmp_path / "out"), "--cluster", cluster]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and re.search(said, complaint), complaint
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("cluster", "module"), [("local", "dask"), ("slurm", "dask_jobqueue"), ("ssh", "asyncssh")])
def test_what_a_cluster_lacks_is_told_before_anything_is_built(
    campaign_file, tmp_path, capsys, monkeypatch, cluster, module
):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == module else name)
    assert run(["campaign", str(campaign_file()), "--out", str(tmp_path / "out"), "--cluster", cluster]) == 2
    complaint = capsys.readouterr().err
    assert (
        complaint.startswith(f"Error: `--cluster` must have {module} installed, but is not. ")
        and "[cluster]" in complaint
    )


@pytest.mark.full
def test_a_damaged_store_is_told_and_mended(campaign_file, tmp_path, capsys):
    path, out = campaign_file(trials=8, chunk=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before = contents(out)
    torn = out / STORE / "position_rms" / "c" / "1"
    torn.write_bytes(torn.read_bytes()[:-1] + b"?")
    capsys.readouterr()
    assert run(["campaign", "status", str(out)]) == 4
    assert re.search(r"is damaged .* --resume` repairs it where possible\n$", capsys.readouterr().err)
    torn.unlink()
    assert run(["campaign", "status", str(out)]) == 0
    assert capsys.readouterr().out == "4 of 8 trials done\n  completed: 4\n"
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 0
    assert "continuing: 4 of 8 trials kept; chunks that were not finished run again" in capsys.readouterr().out
    assert contents(out) == before


@pytest.mark.slow
def test_a_mass_without_its_weight_is_told(campaign_file, tmp_path, capsys):
    """Both by a run and by a campaign, before they begin."""
    scenario = VEHICLE | {"plant": {"vehicle": {"kind": "odin", "mass": 200.0}, "ledger": False}}
    said = r"`weight` must be the weight of the mass, 1962 N, but is .*"
    path = campaign_file(scenario=scenario, vary={}, trials=1, requirements={})
    assert run(["campaign", str(path), "--out", str(tmp_path / "campaign")]) == 0
    assert re.search(f"Advice: trial 0: {said}", capsys.readouterr().err)
    (tmp_path / "one.yaml").write_text(dump(scenario))
    assert run(["simulate", str(tmp_path / "one.yaml"), "--no-prediction", "--out", str(tmp_path / "run")]) == 0
    assert re.search(f"Advice: {said}", capsys.readouterr().err)


@pytest.mark.full
def test_an_earlier_campaign_is_not_touched(campaign_file, tmp_path, capsys):
    path, out = campaign_file(trials=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
    assert "find a campaign to continue" in capsys.readouterr().err
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before = contents(out)
    assert run(["campaign", str(path), "--out", str(out)]) == 2
    assert "Add --resume to continue it, or --overwrite to replace it" in capsys.readouterr().err
    assert contents(out) == before
    assert run(["campaign", str(path), "--out", str(out), "--overwrite"]) == 0
    assert contents(out) == before


@pytest.mark.full
def test_a_refused_overwrite_leaves_a_campaign_that_is_flying(campaign_file, tmp_path, capsys):
    """As another process would find it: the store is locked."""
    path, out = campaign_file(trials=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before = contents(out)
    with file_lock(out / STORE):
        assert run(["campaign", str(path), "--out", str(out), "--overwrite"]) == 2
    assert "must be a folder that nothing else writes to" in capsys.readouterr().err
    assert contents(out) == before


@pytest.mark.full
@pytest.mark.parametrize(
    "content",
    ["", *(pytest.param(one, marks=pytest.mark.slow) for one in ("[]", '{"zarr_format": 3, "node_type": "array"}'))],
)
def test_a_store_without_its_first_file_is_told(campaign_file, tmp_path, capsys, content):
    """Nobody can say any more what its rows are of."""
    path, out = campaign_file(trials=4, requirements={}), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    (out / STORE / "zarr.json").write_text(content)
    capsys.readouterr()
    assert run(["campaign", "status", str(out)]) == 4
    assert re.fullmatch(r"Error: files could not be .* is damaged \(.*\n", capsys.readouterr().err)
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
    assert re.search(
        r"Error: `--out` .*zarr.json is damaged \(.*Use --overwrite to start again\n", capsys.readouterr().err
    )
    assert run(["campaign", str(path), "--out", str(out), "--overwrite"]) == 0


@pytest.mark.full
def test_the_status_of_what_was_stopped_at_once(campaign_file, tmp_path, capsys):
    """No row is written yet, or not even what the campaign is."""
    path, out = campaign_file(trials=4), tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run_campaign(prepare(path), out, stopped, lambda tally: None)
    assert run(["campaign", "status", str(out)]) == 0
    assert capsys.readouterr().out == "0 of 4 trials done\n"
    (out / STORE / "zarr.json").write_text('{"zarr_format": 3, "node_type": "group", "attributes": {}}')
    assert run(["campaign", "status", str(out)]) == 2
    assert "`DIR` must be the folder of a campaign" in capsys.readouterr().err
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 0


def stopped(function, work):
    """An executor that is stopped at once."""
    raise KeyboardInterrupt


@pytest.mark.full
def test_trials_that_will_be_refused_are_told_before(campaign_file, tmp_path, capsys):
    vary = {"controller.frequency": {"uniform": [-1.0, 2.0]}}
    assert run(["campaign", str(campaign_file(trials=12, vary=vary, seed=5)), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr()
    assert re.fullmatch(r"Advice: 1 of the first 4 trials are invalid: `controller.frequency` .*\n", said.err)
    assert re.search(r"100% 12 of 12 trials, [\d.]+ per second, 0 failed, [2-6] invalid\n", said.out)


@pytest.mark.full
def test_a_share_that_so_few_trials_cannot_show_is_told(campaign_file, tmp_path, capsys):
    """The interval of n out of n starts at 0.025^(1/n): 0.9 needs 36 trials, and they are enough."""
    required = {"position_rms": {"below": 1e6, "share": 0.9}}
    verdicts = []
    for trials in (35, 36):
        out = tmp_path / str(trials)
        assert run(["campaign", str(campaign_file(trials=trials, requirements=required)), "--out", str(out)]) == 0
        advised = (
            "which takes at least 36 trials without a failure to demonstrate; `trials` is 35" in capsys.readouterr().err
        )
        combination = json.loads((out / "summary.json").read_text())["combinations"][0]
        verdicts.append((combination["requirements"][0]["verdict"], advised))
    assert verdicts == [("open", True), ("holds", False)]
