"""`undertow campaign` as it is typed: results, page, mistakes, kill -9, and a Dask cluster whose workers are killed."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from distributed import Client, LocalCluster

from undertow.analysis.metrics import OVERALL
from undertow.cli.main import run
from undertow.scenario.reading import dump
from undertow.studies.campaign import store as stores
from undertow.studies.campaign.conduct import STORE, conduct, prepare
from undertow.studies.campaign.engines import by_dask
from undertow.studies.campaign.task import site

TYPED = (sys.executable, "-W", "ignore", "-m", "undertow.cli.main")
VEHICLE = {
    "controller": {"kind": "pid"},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
    "loop": {"duration": 0.1, "dt": 0.01, "record": 0.1},
}
CROSS = {"controller.frequency": {"calm": 2.0, "wild": 500.0}, "plant.limit": [1e30]}


def contents(folder):
    """Bytes of every file of the store."""
    store = folder / STORE
    return {str(file.relative_to(store)): file.read_bytes() for file in sorted(store.rglob("*")) if file.is_file()}


def test_what_it_leaves(campaign_file, tmp_path, capsys):
    path, out = campaign_file(trials=20, cross=CROSS, description="Two PIDs"), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 1  # some failed
    said = capsys.readouterr()
    assert "40 of 40 trials" in said.out and "diverged 20" in said.out and said.err == ""
    found = json.loads((out / "summary.json").read_text())
    calm, wild = found["combinations"]
    assert found["status"] == {"ok": 20, "diverged": 20}
    assert (calm["failed"], wild["failed"]) == (0, 20)
    assert calm["values"]["controller.frequency"] == "calm"
    assert calm["requirements"][0]["verdict"] != "fails" and wild["requirements"][0]["verdict"] == "fails"
    assert found["sensitivity"]["disturbance.amplitude"]["tracking_rms"] > 0.99
    page = re.sub(r"<[^>]+>", " ", (out / "campaign.html").read_text())
    assert "seed 7" in page and "uniform, 0.5 to 2" in page
    for words in ("Two PIDs", "How they ended", "Requirements", "The worst trials", "0.0 % [0.0"):
        assert words in page
    assert {file.name for file in (out / "figures").glob("*.svg")} == {"distributions.svg", "sensitivity.svg"}
    worst = sorted((out / "worst").iterdir())
    assert len(worst) == 5 and all(int(file.stem.split("-")[1]) >= 20 for file in worst)
    assert run(["simulate", str(worst[0]), "--no-prediction", "--out", str(tmp_path / "again")]) == 1
    assert "diverged" in capsys.readouterr().out.lower()
    assert run(["campaign", "status", str(out)]) == 0
    assert "40 of 40 trials done" in capsys.readouterr().out


@pytest.mark.parametrize("duration", [2.0, 2.06])  # ends at a record, and between two
def test_the_worst_trials_are_repeated_bit_for_bit(campaign, campaign_file, tmp_path, duration):
    """Metrics and series of a scenario file from `worst/`, run alone, are those of the lane that it flew in."""
    out, scenario = tmp_path / "out", campaign()["scenario"]
    scenario["loop"]["duration"] = duration
    path = campaign_file(scenario=scenario, series={"signals": ["position", "voltage"], "every": 0.1})
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    rows = xr.open_zarr(out / "trials.zarr", consolidated=False).load()
    for file in sorted((out / "worst").iterdir())[:2]:
        trial, again = int(file.stem.split("-")[1]), tmp_path / file.stem
        assert run(["simulate", str(file), "--no-prediction", "--out", str(again)]) == 0
        found = json.loads((again / "metrics.json").read_text())
        steady = found["steady"]
        assert found["ended"] == float(rows["ended"][trial]) == duration
        for name in OVERALL:
            assert steady[name] == float(rows[name][trial]), name
        series = xr.open_dataset(again / "run.nc")
        for name in ("position", "voltage"):
            np.testing.assert_array_equal(series[name].values, rows[f"series:{name}"][trial].values)
            assert rows[f"series:{name}"].dims[1:] == series[name].dims
        for name in ("time", "axis", "input"):
            np.testing.assert_array_equal(rows[name].values, series[name].values)


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
            r"`requirements.tracking` must be a metric, but is unknown. Did you mean",
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
            {"requirements": {"tracking_rms": 0.1}},
            r"`requirements.tracking_rms` must be a mapping of keys to values, but is 0.1",
        ),
        (
            {"series": {"every": 0.1}, "vary": {"loop.duration": {"uniform": [1.0, 2.0]}}},
            r"`series` must be of runs of one length and sampling time, but is beside loop.duration, which differs",
        ),
        (
            {"vary": {"plant.limit": {"unifrom": [1.0, 2.0]}}},
            r"`vary.plant.limit.unifrom` must be a key of the campaign, .*line 14\). Did you mean `uniform`\?",
        ),
        (
            {"requirements": {"tracking_rms": {"below": 1.0, "sahre": 0.5}}},
            r"`requirements.tracking_rms.sahre` must be .* Did you mean `share`\?",
        ),
        ({"series": {"evry": 1.0}}, r"`series.evry` must be .* Did you mean `every`\?"),
        (
            {"vary": {"controller.frequency": {"uniform": [-2.0, -1.0]}}},  # none of the first trials can be built
            r"`controller.frequency` must be positive, but is -1.\d+ \(small.yaml, line 13, trial 0\)",
        ),
        (
            {"vary": {}, "scenario": {"reference": "setpont"}},
            r"`reference.kind` .* \(small.yaml, line 1, trial 0\). Did you mean `setpoint`",
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
        ({"cross": {"seed": [1, 2]}}, r"`cross.seed` must be left out \(small.yaml, line \d+\). Every trial has one"),
        (
            {"vary": {"sensor.velocity": {"uniform": [0.0, 1.0]}, "sensor": {"choice": ["perfect"]}}},
            r"`sensor.velocity` must not be beside sensor, which it is a part of",
        ),
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
            r"`CAMPAIGN` must be a campaign, but is a scenario .*`undertow simulate` runs it",
        ),
        (
            ["simulate", "campaign.yaml"],
            r"`scenario` must be a key of campaigns only .*`undertow campaign` flies campaigns",
        ),
        (["campaign", "campaign.yaml", "out"], r"`DIR` must follow the word `status`, but is out. .*`--out out`"),
        (["campaign", "status", "out", "--resume"], r"`--resume` must be left out with `status`"),
        (["campaign", "campaign.yaml", "--out", "/proc/out"], r"files could not be read or written: .* \(/proc/out"),
    ],
)
def test_a_mistake_on_the_command_line(campaign, campaign_file, tmp_path, capsys, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    campaign_file("campaign")
    Path("scenario.yaml").write_text(dump(campaign()["scenario"]))
    assert run(arguments) in (2, 4)
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1 and re.search(said, complaint), complaint
    assert {file.name for file in tmp_path.iterdir()} == {"campaign.yaml", "scenario.yaml"}


def test_a_damaged_store_is_told_and_mended(campaign_file, tmp_path, capsys):
    path, out = campaign_file(trials=8, chunk=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before = contents(out)
    torn = out / STORE / "tracking_rms" / "c" / "1"
    torn.write_bytes(torn.read_bytes()[:-1] + b"?")
    capsys.readouterr()
    assert run(["campaign", "status", str(out)]) == 4
    assert re.search(r"is damaged .* --resume` flies it again\n$", capsys.readouterr().err)
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 0
    assert contents(out) == before


@pytest.mark.parametrize(
    "cluster, said",
    [
        ("slurm", r"`--cluster` must find a SLURM that answers, but is sinfo: no configuration"),
        ("ssh", r"`UNDERTOW_HOSTS` must name the hosts, separated by commas, but is not set"),
        ("pbs", r"`--cluster` must be one of local, slurm, ssh, or an address, but is pbs"),
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


def test_trials_that_cannot_be_built_are_neither_worst_nor_a_failure_of_the_law(campaign_file, tmp_path, capsys):
    """A frequency below zero is no controller: trials with one are counted apart."""
    path, out = (
        campaign_file(trials=12, vary={"controller.frequency": {"uniform": [-1.0, 2.0]}}, seed=5),
        tmp_path / "out",
    )
    assert run(["campaign", str(path), "--out", str(out)]) == 1
    found = json.loads((out / "summary.json").read_text())
    rows = xr.open_zarr(out / STORE, consolidated=False).load()
    flown = rows["status"].values == 0
    assert 0 < found["status"]["refused"] == (~flown).sum() < 7
    assert flown[found["worst"]].all() and len(found["worst"]) == 5
    share = (rows["tracking_rms"].values[flown] < 0.2).mean()
    assert found["combinations"][0]["requirements"][0]["kept"] == pytest.approx(share)
    first = int(np.argmin(flown))
    (refused,) = found["refused"]
    assert refused["trials"] == (~flown).sum()
    assert re.fullmatch(rf"`controller.frequency` must be positive, .*, line 13, trial {first}\)", refused["why"])
    assert refused["why"] in capsys.readouterr().out


def test_other_requirements_need_no_flight(campaign_file, tmp_path, capsys):
    """The rows stay as they are, and the summary says what is required now."""
    out = tmp_path / "out"
    verdict = lambda: json.loads((out / "summary.json").read_text())["combinations"][0]["requirements"][0]["verdict"]
    assert run(["campaign", str(campaign_file()), "--out", str(out)]) == 0
    before = contents(out)
    stricter = campaign_file("stricter", requirements={"tracking_rms": {"below": 1e-6, "share": 0.5}})
    assert run(["campaign", str(stricter), "--out", str(out), "--resume"]) == 0
    after = contents(out)
    assert verdict() == "fails"
    assert {name for name in after if before.get(name) != after[name]} == {"zarr.json"}
    assert run(["campaign", str(campaign_file()), "--out", str(out), "--resume"]) == 0
    assert verdict() == "holds" and contents(out) == before


def test_what_is_drawn_from_words_is_told_apart(campaign_file, tmp_path):
    """By choice: as many trials as drew it, and the quantiles of those."""
    path = campaign_file(vary={"sensor": {"choice": ["perfect", {"kind": "white_noise", "velocity": 0.5}]}}, seed=3)
    out = tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    found = json.loads((out / "summary.json").read_text())["choices"]["sensor"]
    rows = xr.open_zarr(out / STORE, consolidated=False).load()
    for number, one in enumerate(found.values()):
        chosen = rows["tracking_rms"].values[rows["vary:sensor"].values == number]
        assert one["trials"] == len(chosen) > 5
        assert one["metrics"]["tracking_rms"]["0.5"] == np.median(chosen)
    assert list(found) == rows["vary:sensor"].attrs["choices"]


def test_a_mass_without_its_weight_is_told(campaign_file, tmp_path, capsys):
    """Both by a run and by a campaign, before they begin."""
    scenario = VEHICLE | {"plant": {"vehicle": {"kind": "odin", "mass": 200.0}}}
    said = r"`weight` must be the weight of the mass, 1962 N, but is .*"
    path = campaign_file(scenario=scenario, vary={}, trials=1, requirements={})
    assert run(["campaign", str(path), "--out", str(tmp_path / "campaign")]) == 0
    assert re.search(f"Advice: trial 0: {said}", capsys.readouterr().err)
    (tmp_path / "one.yaml").write_text(dump(scenario))
    assert run(["simulate", str(tmp_path / "one.yaml"), "--no-prediction", "--out", str(tmp_path / "run")]) == 0
    assert re.search(f"Advice: {said}", capsys.readouterr().err)


def test_an_earlier_campaign_is_not_touched(campaign_file, tmp_path, capsys):
    path, out = campaign_file(trials=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
    assert "find a campaign to go on with" in capsys.readouterr().err
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before = contents(out)
    assert run(["campaign", str(path), "--out", str(out)]) == 2
    assert "Add --resume to go on with it, or --overwrite to begin anew" in capsys.readouterr().err
    assert contents(out) == before
    assert run(["campaign", str(path), "--out", str(out), "--overwrite"]) == 0
    assert contents(out) == before


def typed(path, out, *options, **settings):
    arguments = [*TYPED, "campaign", str(path), "--out", str(out), *options]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(arguments, **(quiet | settings))


def killed(path, out, kills, longest):
    """Start the campaign, kill it after a while, and so on; then let it finish. Kills that came before the end."""
    counted = 0
    for number in range(kills):
        process = typed(path, out, *(["--resume"] if (out / STORE).exists() else []))
        began = time.monotonic()
        # The first result of a process takes seconds: waiting for the store to grow makes every kill count.
        before = len(list(out.rglob("*")))
        while len(list(out.rglob("*"))) == before and process.poll() is None and time.monotonic() - began < 120:
            time.sleep(0.01)
        time.sleep(longest * number / max(kills, 1))
        process.send_signal(signal.SIGKILL)
        counted += process.wait() == -signal.SIGKILL
    assert typed(path, out, *(["--resume"] if (out / STORE).exists() else [])).wait() == 0
    return counted


def test_kill_9_loses_nothing(campaign_file, tmp_path):
    path = campaign_file(trials=400, chunk=20)
    assert typed(path, tmp_path / "whole").wait() == 0
    assert killed(path, tmp_path / "killed", kills=1, longest=0.1) == 1
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


@pytest.mark.slow
def test_kill_9_at_twenty_moments(campaign_file, tmp_path):
    path = campaign_file(trials=2000, chunk=5)
    assert typed(path, tmp_path / "whole").wait() == 0
    assert killed(path, tmp_path / "killed", kills=20, longest=0.5) == 20
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


def test_dask_workers_that_are_killed_lose_nothing(campaign_file, tmp_path):
    """A real cluster of two processes; one of them dies after the first results."""
    path = campaign_file(trials=200, chunk=20)
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        seen = []

        def watch(done, total, failed):
            seen.append(done)
            if len(seen) == 3:
                os.kill(workers[0], signal.SIGKILL)

        conduct(prepare(path), tmp_path / "cluster", lambda f, work: by_dask(f, work, client), watch)
    assert seen[-1] == 200 and len(seen) == 11  # no task twice
    assert contents(tmp_path / "cluster") == contents(tmp_path / "whole")


def test_ctrl_c_ends_a_cluster_in_one_line(campaign_file, tmp_path):
    """As a terminal sends it: to the process, the scheduler and the workers at once."""
    path, out = campaign_file(trials=20_000, chunk=5), tmp_path / "out"
    process = typed(path, out, "--cluster", "local", start_new_session=True, stderr=subprocess.PIPE)
    while process.poll() is None and len(list(out.rglob("c/*"))) < 20:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    complaint = process.communicate(timeout=60)[1].decode()
    assert process.returncode == 130
    assert complaint == f"Stopped. `undertow campaign {path} --out {out} --resume` goes on.\n"
    waited = time.monotonic() + 60
    with pytest.raises(ProcessLookupError):  # soon nobody is left
        while time.monotonic() < waited:
            os.killpg(process.pid, 0)
            time.sleep(0.1)


def test_a_dead_scheduler_loses_nothing(campaign_file, tmp_path):
    """A scheduler in a process of its own is killed after the first results; the rest is flown without it."""
    path, out, file = campaign_file(trials=200, chunk=20), tmp_path / "cluster", tmp_path / "scheduler.json"
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    with contextlib.ExitStack() as stack:
        process = lambda *words: stack.enter_context(
            started(sys.executable, "-m", *words, "--scheduler-file", str(file))
        )
        scheduler = process("distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard")
        waited = time.monotonic() + 60
        while not file.exists() and time.monotonic() < waited:
            time.sleep(0.1)
        process("distributed.cli.dask_worker", "--nworkers", "1", "--nthreads", "1", "--no-dashboard", "--no-nanny")
        client = stack.enter_context(Client(json.loads(file.read_text())["address"], timeout=60))
        client.wait_for_workers(1, timeout=60)
        seen = []

        def watch(done, total, failed):
            seen.append(done)
            if len(seen) == 3:
                scheduler.kill()

        with pytest.raises(OSError, match="Dask cluster is gone"):
            conduct(prepare(path), out, lambda f, work: by_dask(f, work, client), watch)
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 0
    assert contents(out) == contents(tmp_path / "whole")


@pytest.mark.slurm
def test_slurm(campaign_file, tmp_path, monkeypatch):
    """A real SLURM of one machine: `--cluster slurm` as it is typed, two jobs of one worker each."""
    script, folder = Path(__file__).with_name("slurm.sh"), tmp_path / "slurm"
    subprocess.run([script, "start", folder], check=True)
    monkeypatch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
    path = campaign_file(trials=200, chunk=20)
    try:
        assert typed(path, tmp_path / "cluster", "--cluster", "slurm", "--workers", "2", cwd=tmp_path).wait() == 0
    finally:
        subprocess.run([script, "stop", folder], check=True)
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    assert contents(tmp_path / "cluster") == contents(tmp_path / "whole")


@pytest.mark.ssh
def test_ssh(campaign_file, tmp_path):
    """A real SSH server on this machine: `--cluster ssh` as it is typed, two workers; and who is not let in."""
    script, folder = Path(__file__).with_name("sshd.sh"), tmp_path / "ssh"
    subprocess.run([script, "start", folder], check=True)
    path = campaign_file(trials=200, chunk=20)
    start = partial(typed, path, tmp_path / "cluster", "--cluster", "ssh", "--workers", "2")
    known = {**os.environ, "HOME": str(folder), "UNDERTOW_HOSTS": "127.0.0.1"}
    try:
        stranger = start(env={**known, "HOME": str(tmp_path)}, stderr=subprocess.PIPE)
        complaint = stranger.communicate()[1].decode()
        assert stranger.returncode == 2 and not (tmp_path / "cluster" / STORE).exists()
        assert re.fullmatch(r"Error: `UNDERTOW_HOSTS` must be hosts that let us in, but is 127.0.0.1: .*\n", complaint)
        assert start(env=known).wait() == 0
    finally:
        subprocess.run([script, "stop", folder], check=True)
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    assert contents(tmp_path / "cluster") == contents(tmp_path / "whole")


@contextlib.contextmanager
def started(*words):
    """A process that does not outlive its use."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_refused_overwrite_leaves_a_campaign_that_is_flying(campaign_file, tmp_path, capsys):
    """As another process would find it: the store is locked."""
    path, out = campaign_file(trials=4), tmp_path / "out"
    assert run(["campaign", str(path), "--out", str(out)]) == 0
    before, held = contents(out), stores._locked(out / STORE)
    assert run(["campaign", str(path), "--out", str(out), "--overwrite"]) == 2
    os.close(held)
    assert "must be a folder that nothing else writes to" in capsys.readouterr().err
    assert contents(out) == before


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
    found = json.loads((tmp_path / "again" / "metrics.json").read_text())["steady"]["tracking_rms"]
    assert found == float(xr.open_zarr(out / STORE, consolidated=False)["tracking_rms"][trial])
    (tmp_path / "d.csv").write_text(rows.format(2.0))
    site.cache_clear()  # as in a process that begins
    assert run(["campaign", str(path), "--out", str(out), "--resume"]) == 2
    assert "with another scenario" in capsys.readouterr().err
