"""Logs are written in a thread: a disk that blocks holds up no step, what is missing is said, `kill -9` costs a second."""

import io
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import undertow as ut
from undertow.logs import background_writer, mcap_writer

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [0]},
    "loop": {"duration": 4.0, "dt": 0.01, "record": 0.01},
}

LIVE = """
import sys, time, numpy as np, undertow as ut
autopilot = ut.Autopilot(%r, log=sys.argv[1])
autopilot.start(np.zeros(1), np.zeros(1))
for k in range(1, 10**9):
    autopilot.step(np.array([k]) * 1e-3, np.zeros(1))
    print(time.monotonic(), flush=True)
    time.sleep(0.003)
"""


@pytest.mark.full
def test_kill_9_costs_a_log_the_last_second(tmp_path):
    """The process is killed while it writes; the steps before are there, without gaps, and no end record."""
    path, stepped = tmp_path / "dive.mcap", []
    with subprocess.Popen([sys.executable, "-c", LIVE % AXIS, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            stepped.append(float(line))
            if stepped[-1] - stepped[0] > 1.4:
                os.kill(process.pid, signal.SIGKILL)
    log = ut.read_log(path)
    steps = log["measured_position"]
    before = sum(time < stepped[-1] - 1.0 for time in stepped)
    assert len(steps.time) > before > 10
    np.testing.assert_allclose(steps.time, np.arange(len(steps.time)) * 0.01, atol=1e-9)
    np.testing.assert_array_equal(steps.values[:, 0], np.arange(len(steps.time)) * 1e-3)
    commands = log["commanded_input"].values  # of another channel: the last chunk may end between the two
    assert len(steps.time) - len(commands) in (0, 1) and commands.shape[1] == 1
    assert any("ends early" in note for note in log.notes) or not path.read_bytes().endswith(b"\x89MCAP0\r\n")


class BlockingFile(io.FileIO):
    """A file on a disk that does not answer while it is `stuck`."""

    def __init__(self, path):
        super().__init__(path, "wb")
        self.answers, self.writers = threading.Event(), set()

    def write(self, data):
        self.writers.add(threading.current_thread())
        self.answers.wait()
        return super().write(data)


@pytest.fixture
def disk(monkeypatch):
    """The files of logs, which do not answer; others are opened as ever."""
    usual, files = Path.open, []

    def opened(path, *arguments, **options):
        if path.suffix != ".mcap" or arguments != ("wb",):
            return usual(path, *arguments, **options)
        files.append(BlockingFile(path))
        return io.BufferedWriter(files[-1])

    monkeypatch.setattr(Path, "open", opened)
    yield files
    for file in files:
        file.answers.set()


@pytest.mark.full
def test_a_disk_that_blocks_holds_up_no_step(tmp_path, disk):
    """Commands go on, and are those without a log; this thread never writes. Then the disk answers: all is there."""
    autopilot, silent, at = ut.Autopilot(AXIS, log=tmp_path / "a.mcap"), ut.Autopilot(AXIS), (np.ones(1), np.zeros(1))
    assert autopilot.start(*at) == silent.start(*at)
    for _ in range(2000):  # some 400 kB, more than any buffer holds
        assert autopilot.step(*at) == silent.step(*at)
    assert (tmp_path / "a.mcap").stat().st_size == 0
    disk[0].answers.set()
    autopilot.close_log()
    assert threading.current_thread() not in disk[0].writers != set()
    assert len(ut.read_log(tmp_path / "a.mcap")["elapsed"].time) == 2001 and autopilot.counts["not recorded"] == 0


def test_steps_without_a_place_are_counted_and_noted(tmp_path, disk, monkeypatch):
    """The queue holds ten, and the disk blocks; steps wait while they are ahead of real time, not longer."""
    monkeypatch.setattr(background_writer.BackgroundWriter.__init__, "__defaults__", (10,))
    monkeypatch.setattr(mcap_writer, "_LIVE_CHUNK", 100)
    fast = {"loop": {"duration": 1.0, "dt": 1e-5, "record": 0.01}}
    autopilot, at = ut.Autopilot(AXIS | fast, log=tmp_path / "a.mcap"), (np.ones(1), np.zeros(1))
    autopilot.start(*at)
    for _ in range(200):
        autopilot.step(*at)
    dropped = autopilot.counts["not recorded"]
    assert 100 < dropped < 200
    disk[0].answers.set()
    with pytest.warns(UserWarning, match=rf"a\.mcap: {dropped} steps are missing: the disk was too slow"):
        autopilot.close_log()
    log = ut.read_log(tmp_path / "a.mcap")
    assert (
        len(log["elapsed"].time) == 201 - dropped and f"{dropped} steps are missing: the disk was too slow" in log.notes
    )


def test_a_disk_that_never_answers_keeps_nobody_from_the_end(tmp_path, disk, monkeypatch):
    monkeypatch.setattr(background_writer, "_DRAIN", 0.05)
    autopilot, at = ut.Autopilot(AXIS, log=tmp_path / "a.mcap"), (np.ones(1), np.zeros(1))
    autopilot.start(*at)
    with pytest.warns(UserWarning, match=r"a\.mcap: the disk did not answer within 0.05 s at the end"):
        autopilot.close_log()
