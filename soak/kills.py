"""Campaigns that are killed at random moments, damaged and resumed: each must end with the undisturbed table."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from soak import specimens
from soak.verdict import Failure
from undertow.scenario.reading import dump
from undertow.scenario.yaml_text import load
from undertow.studies.campaign.run_campaign import STORE

_COMMAND = (sys.executable, "-W", "ignore", "-m", "undertow", "campaign")
_LATEST = 120.0  # s, for one process

# Signals and how often each of twenty ends a campaign; the exit codes of those that it may answer.
_SIGNALS = [signal.SIGKILL] * 16 + [signal.SIGINT] * 2 + [signal.SIGTERM] * 2
_ANSWERS = {signal.SIGINT: 130, signal.SIGTERM: 143}

_DAMAGED, _DISK_FULL, _SECOND = 0.2, 0.15, 0.05  # chance of each, before a campaign is resumed


class Kills(NamedTuple):
    """Result of kills.

    Attributes:
        kills: processes that were ended before they had finished.
        campaigns: that were begun, ended and resumed until they were complete.
        trials: of each campaign.
        damaged: files of unfinished stores that were spoilt before resuming.
        disk_full: processes whose files could not grow.
        second: processes that were started while another one was writing.
        failures: never-events.
        seconds: elapsed time.
    """

    kills: int
    campaigns: int
    trials: int
    damaged: int
    disk_full: int
    second: int
    failures: list[Failure]
    seconds: float


def kill_campaigns(
    kills: int,
    seed: int,
    folder: Path,
    trials: int = 400,
    until: float = float("inf"),
    watch: Callable[[int], None] = lambda done: None,
) -> Kills:
    """End campaigns so many times, resume them, and compare their tables with that of an undisturbed one.

    Args:
        kills: how many processes to end.
        seed: of the moments and of the damage.
        folder: for the campaigns; empty.
        trials: of each of the two combinations of a campaign.
        until: time of `time.monotonic` after which no further campaign begins.
        watch: called with the number of kills.
    """
    began = time.monotonic()
    chance = random.Random(f"kills/{seed}")
    path = folder / "c.yaml"
    data = load(specimens.CAMPAIGN, "", "")[0] | {"trials": trials, "chunk": 5}
    path.write_text(dump(data), encoding="utf-8")
    undisturbed = _start(path, folder / "whole")
    if undisturbed.wait() not in (0, 1):
        message = f"an undisturbed campaign ended with exit code {undisturbed.returncode}"
        return Kills(0, 1, 2 * trials, 0, 0, 0, [Failure("N2", f"kills/{seed}/0", message)], time.monotonic() - began)
    expected = _contents(folder / "whole")
    sabotage = _Sabotage(chance, path)
    failures: list[Failure] = []
    campaigns = 0
    while sabotage.kills < kills and time.monotonic() < until:
        campaigns += 1
        identity = f"kills/{seed}/{campaigns}"
        out = folder / "killed"
        for event, message in sabotage.one_campaign(out, kills, watch):
            failures.append(Failure(event, identity, message))
        contents = _contents(out)
        if contents != expected:
            differing = sorted(name for name in {*contents, *expected} if contents.get(name) != expected.get(name))
            failures.append(Failure("N5", identity, f"{len(differing)} files differ, such as {differing[0]}"))
        shutil.rmtree(out)
    counted = (sabotage.damaged, sabotage.disk_full, sabotage.second)
    return Kills(sabotage.kills, campaigns, 2 * trials, *counted, failures, time.monotonic() - began)


class _Sabotage:
    """Ends processes and spoils files, and counts what it did."""

    def __init__(self, chance: random.Random, path: Path):
        self._chance, self._path = chance, path
        self.kills = self.damaged = self.disk_full = self.second = 0

    def one_campaign(self, out: Path, most: int, watch: Callable[[int], None]) -> list[tuple[str, str]]:
        """One campaign from its beginning to its end; never-events."""
        events: list[tuple[str, str]] = []
        while True:
            full = self._chance.random() < _DISK_FULL
            process = _start(self._path, out, self._chance.choice((400, 1500, 4000)) if full else 0)
            if self.kills >= most:
                return events + self._finish(process, out)
            code_after_signal = self._kill(process, out)
            if code_after_signal is None:  # it had finished, or its files could not grow
                code = process.returncode
                if full and code == 4:
                    self.disk_full += 1
                elif code in (0, 1):
                    return events
                else:
                    return [*events, ("N2", f"a resumed campaign ended with exit code {code}")]
            else:
                self.kills += 1
                watch(self.kills)
                if code_after_signal not in (-int(signal.SIGKILL), *_ANSWERS.values(), 4):
                    events.append(("N2", f"a process that got a signal ended with exit code {code_after_signal}"))
            if (out / STORE).exists() and self._chance.random() < _DAMAGED:
                self._damage(out / STORE)

    def _kill(self, process: subprocess.Popen, out: Path) -> int | None:
        """End a process some time after its store grew; how it ended, None where it ended by itself."""
        before = _size(out)
        began = time.monotonic()
        while _size(out) == before and process.poll() is None and time.monotonic() - began < _LATEST:
            time.sleep(0.01)
        if self._chance.random() < _SECOND and process.poll() is None:
            self.second += 1
            second = _start(self._path, out)
            second.wait()
        time.sleep(self._chance.uniform(0.0, 0.4))
        if process.poll() is not None:
            return None
        process.send_signal(self._chance.choice(_SIGNALS))
        return process.wait(_LATEST)

    def _finish(self, process: subprocess.Popen, out: Path) -> list[tuple[str, str]]:
        """Let a campaign come to its end; once more where its files could not grow."""
        process.wait(_LATEST)
        if process.returncode == 4:
            self.disk_full += 1
            process = _start(self._path, out)
            process.wait(_LATEST)
        code = process.returncode
        return [] if code in (0, 1) else [("N2", f"a resumed campaign ended with exit code {code}")]

    def _damage(self, store: Path) -> None:
        """Cut off a chunk, turn a bit of it, or leave half a file beside it, as a disk does."""
        chunks = sorted(path for path in store.rglob("*") if path.is_file() and "c" in path.relative_to(store).parts)
        if not chunks:
            return
        self.damaged += 1
        chunk = self._chance.choice(chunks)
        data = bytearray(chunk.read_bytes())
        sample = self._chance.random()
        if sample < 0.4 and data:
            data[self._chance.randrange(len(data))] ^= 1 << self._chance.randrange(8)
            chunk.write_bytes(bytes(data))
        elif sample < 0.8:
            chunk.write_bytes(bytes(data[: self._chance.randrange(len(data) + 1)]))
        else:
            chunk.with_name(f"{chunk.name}.0123.partial").write_bytes(bytes(data[: len(data) // 2]))


def _start(path: Path, out: Path, largest: int = 0) -> subprocess.Popen:
    """Start or resume a campaign; no file may become larger than so many bytes, 0 for any size."""
    words = [*_COMMAND, str(path), "--out", str(out), "--workers", "1"]
    words += ["--resume"] if (out / STORE).exists() else []
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(words, preexec_fn=limit if largest else None, **quiet)  # pyright: ignore[reportCallIssue,reportArgumentType]


def _contents(out: Path) -> dict[str, bytes]:
    """Bytes of every file of a store."""
    store = out / STORE
    return {str(file.relative_to(store)): file.read_bytes() for file in sorted(store.rglob("*")) if file.is_file()}


def _size(out: Path) -> int:
    """Number of files of a store, whose process may move folders meanwhile."""
    return sum(len(folders) + len(files) for _, folders, files in os.walk(out / STORE))
