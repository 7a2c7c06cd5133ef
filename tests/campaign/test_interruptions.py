"""Kill -9, Ctrl-C and clusters: whatever dies, the store ends the same to the byte."""

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

import psutil
import pytest
from command import contents, typed
from distributed import Client, LocalCluster

from undertow.cli.main import run
from undertow.simulation.executors import by_dask, cluster
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.run_campaign import STORE, run_campaign

pytestmark = pytest.mark.full


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
    assert run(["campaign", str(path), "--out", str(out), *(["--resume"] if (out / STORE).exists() else [])]) == 0
    return counted


@pytest.mark.slow
def test_kill_9_loses_nothing(campaign_file, tmp_path):
    path = campaign_file(trials=200, chunk=10)
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    assert killed(path, tmp_path / "killed", kills=1, longest=0.1) == 1
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


@pytest.mark.slow
def test_kill_9_at_twenty_moments(campaign_file, tmp_path):
    path = campaign_file(trials=2000, chunk=5)
    assert typed(path, tmp_path / "whole").wait() == 0
    assert killed(path, tmp_path / "killed", kills=20, longest=0.5) == 20
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


@pytest.mark.slow
def test_dask_workers_that_are_killed_lose_nothing(campaign_file, tmp_path):
    """A real cluster of two processes; one of them dies after the first results."""
    path = campaign_file(trials=200, chunk=20)
    assert run(["campaign", str(path), "--out", str(tmp_path / "whole")]) == 0
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = list(client.run(os.getpid).values())
        seen = []

        def watch(tally):
            seen.append(tally.done)
            if len(seen) == 3:
                os.kill(workers[0], signal.SIGKILL)

        run_campaign(prepare(path), tmp_path / "cluster", lambda f, work: by_dask(f, work, client), watch)
    assert seen[-1] == 200 and len(seen) == 11  # no task twice
    assert contents(tmp_path / "cluster") == contents(tmp_path / "whole")


def test_a_local_cluster_listens_on_this_machine_only():
    """Scheduler, workers and status page: others in the network find no door."""
    with cluster("local", 1):
        ours = [psutil.Process(), *psutil.Process().children(recursive=True)]
        found = [one for process in ours for one in process.net_connections("tcp") if one.status == psutil.CONN_LISTEN]
    assert len(found) >= 3 and {one.laddr.ip for one in found} == {"127.0.0.1"}


@pytest.mark.slow
def test_ctrl_c_ends_a_cluster_in_one_line(campaign_file, tmp_path):
    """As a terminal sends it: to the process, the scheduler and the workers at once."""
    path, out = campaign_file(trials=20_000, chunk=5), tmp_path / "out"
    process = typed(path, out, "--cluster", "local", "--workers", "1", start_new_session=True, stderr=subprocess.PIPE)
    while process.poll() is None and len(list(out.rglob("c/*"))) < 20:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    complaint = process.communicate(timeout=60)[1].decode()
    assert process.returncode == 130
    kept = rf"\nInterrupted: stopping\.\nStopped: \d+ of 20000 trials are in {out}\. "
    assert re.fullmatch(rf"{kept}To continue: undertow campaign {path} --out {out} --resume\n", complaint), complaint
    waited = time.monotonic() + 60
    with pytest.raises(ProcessLookupError):  # soon nobody is left
        while time.monotonic() < waited:
            os.killpg(process.pid, 0)
            time.sleep(0.1)


@pytest.mark.slow
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

        def watch(tally):
            seen.append(tally.done)
            if len(seen) == 3:
                scheduler.kill()

        with pytest.raises(OSError, match="the connection to the Dask cluster is lost"):
            run_campaign(prepare(path), out, lambda f, work: by_dask(f, work, client), watch)
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
        assert re.fullmatch(
            r"Error: `UNDERTOW_HOSTS` must be hosts that accept the login, but is 127.0.0.1: .*\n", complaint
        )
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
