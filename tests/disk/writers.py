"""Everything that writes files, over an earlier result, on a disk that fails; run with `failing_disk.c` preloaded.

    LD_PRELOAD=failing_disk.so python writers.py FOLDER MOST NAMES...

For each writer an earlier result is there, and each call that changes the disk fails once (MOST of them at most): by a full
disk, by an error of input and output, or by the end of the process. Then the same is written again, and must succeed.
Prints a line of JSON per writer.
"""

import contextlib
import ctypes
import errno
import io
import json
import os
import shutil
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.cli.main import run as command
from undertow.control.controllers.robust.knowledge import _SIGNALS, save_knowledge
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.read import read_log
from undertow.outside.export.c_program import Exported
from undertow.outside.rerun_file import write_rerun
from undertow.outside.ros2.write_bag import write_rosbag2
from undertow.scenario.results.netcdf import save
from undertow.simulation.checkpoint import Checkpoint

_RESCUED = "out/out-rescued-1/"
HOW = {"full": errno.ENOSPC, "error": errno.EIO, "killed": -1}

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1]},
    "loop": {"duration": 0.2, "dt": 0.01, "record": 0.01},
}


class Refused(Exception):
    """A command ended with an exit code, and these lines on stderr."""


class Writer(NamedTuple):
    """What writes results.

    Attributes:
        write: writes version 0 or 1 of them into a folder; both may be there. What it returns it said on stderr.
        whole: why a file is not whole that has neither the earlier nor the new bytes, by its path; "" where it is.
        marker: once this file is the new one, files of an earlier result may be gone.
        alike: how much the bytes of a version may differ from one time to the next, as a share of its size.
        remade: where the files are that the next try makes again from what was stored.
    """

    write: Callable[[Path, int], str | None]
    whole: Callable[[Path], str] = lambda path: "neither the earlier nor the new one"
    marker: str = ""
    alike: float = 0.0
    remade: str = ""


def words(*given: str) -> Callable[[Path, int], str]:
    """A command, which gives what it said on stderr; {folder} and {version} are replaced."""

    def write(folder: Path, version: int) -> str:
        said = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            code = command([word.format(folder=folder, version=version) for word in given])
        if code not in (0, 1):
            raise Refused(code, said.getvalue())
        return said.getvalue()

    return write


def a_log(version: int) -> Log:
    time = np.arange(300) * 0.01
    return Log({"depth": Series(time, time + version, (), "m")}, "x", "CSV")


def a_dive(version: int) -> xr.Dataset:
    """As much of the records of a vehicle as a bag needs."""
    rows = np.linspace(0, 1, 50)[:, None] * np.arange(1, 7) / 10 + version
    pose = {name: (("time", "axis"), rows) for name in ("measured_position", "position", "reference")}
    rates = {name: (("time", "axis"), 0 * rows) for name in ("measured_velocity", "velocity")}
    applied = {"input": (("time", "actuator"), rows, {"units": "V"})}
    return xr.Dataset(pose | rates | applied, {"time": np.arange(50) * 0.1, "axis": list(BODY_OUTPUTS)})


def evaluations(folder: Path, version: int) -> None:
    """A tuning that is stopped after 20 evaluations, and goes on to 40; killed within a line, as it may be."""
    path = folder / "tuning.jsonl"
    resume = bool(version)
    if resume:
        with path.open("a", encoding="utf-8") as file:
            file.write('{"half')
    checkpoint = Checkpoint(path, "this tuning", np.inf, resume)
    for k in range(20 + 20 * version):
        checkpoint.ask("cost", np.array([k]), lambda k=k: float(k))


def of_a_checkpoint(path: Path) -> str:
    """All evaluations of the first 20 are there; the last line alone may be incomplete."""
    lines = path.read_text().splitlines(keepends=True)
    found = [json.loads(line) for line in lines if line.endswith("\n")]
    return "" if [one["answer"] for one in found[1:21]] == list(range(20)) else f"a checkpoint with {len(found)} lines"


def of_a_log(path: Path) -> str:
    """A log that is being written can be read."""
    if path.suffix != ".mcap":
        return "neither the earlier nor the new one"
    try:
        read_log(path)
    except BadInput as error:
        nothing_yet = "which has none" in str(error) or "at byte 0" in str(error)
        return "" if path.stat().st_size < 2**14 and nothing_yet else str(error)
    return ""


def of_a_run(path: Path) -> str:
    """Metrics are written before they are compared with a prediction, and a page lacks a figure that failed."""
    if path.suffix == ".json":
        return "" if json.loads(path.read_text()) else "empty"
    return "" if path.read_text().endswith("</html>\n") else "a part of a page"


def of_a_campaign(path: Path) -> str:
    """A store is whole by its own rules, and a page lacks a figure that failed."""
    return of_a_run(path) if path.suffix == ".html" else "neither the earlier nor the new one" * (not in_store(path))


def in_store(path: Path) -> bool:
    return "trials.zarr" in path.parts


def writers(inputs: Path) -> dict[str, Writer]:
    """What is tried, by name."""
    inputs.mkdir()
    for version in (0, 1):
        scenario = AXIS | {"controller": {"kind": "pid", "frequency": 2.0 + version}}
        (inputs / f"{version}.yaml").write_text(json.dumps(scenario))
        a_log(version).save(inputs / f"{version}.mcap")
        campaign = {"scenario": "0.yaml", "trials": 2 + version, "vary": {"controller.frequency": {"uniform": [1, 2]}}}
        (inputs / f"study{version}.yaml").write_text(json.dumps(campaign))
    scenario, log = f"{inputs}/{{version}}.yaml", f"{inputs}/{{version}}.mcap"
    knowledge = lambda version: xr.Dataset({name: ("time", np.arange(4.0) + version) for name in _SIGNALS.values()})
    files = lambda version: {
        "a.c": "int a;\n" * 9000 + str(version),
        "b.h": f"{version}",
        "c.fmu": bytes([version]) * 99,
    }
    out = ("--out", "{folder}/out", "--overwrite")

    def study(folder: Path, version: int) -> str:
        resume = ["--resume"] if version else []
        return words("campaign", f"{inputs}/study{{version}}.yaml", "--out", "{folder}/out", *resume)(folder, version)

    return {
        "run.nc": Writer(lambda folder, version: save(a_dive(version), folder / "run.nc"), alike=0.01),
        "knowledge": Writer(lambda folder, version: save_knowledge(folder / "a.npz", knowledge(version))),
        "checkpoint": Writer(evaluations, of_a_checkpoint),
        "export": Writer(lambda folder, version: Exported(files(version)).write(folder, True)),
        "bag, mcap": Writer(lambda folder, version: write_rosbag2(a_dive(0), folder / f"bag{version}", "mcap")),
        "bag, sqlite3": Writer(lambda folder, version: write_rosbag2(a_dive(0), folder / f"bag{version}", "sqlite3")),
        "rerun": Writer(lambda folder, version: write_rerun(a_log(version), folder / "a.rrd"), alike=0.05),
        "log, mcap": Writer(words("logs", log, "--out", "{folder}/a.mcap", "--overwrite")),
        "log, csv": Writer(words("logs", log, "--out", "{folder}/a.csv", "--overwrite")),
        "layout": Writer(words("logs", "layout", "--out", "{folder}/layout{version}.json", "--overwrite")),
        "init": Writer(words("init", "{folder}/study{version}.yaml")),
        "simulate": Writer(words("simulate", scenario, *out), of_a_run, "out/run.nc", 0.05),
        "run": Writer(words("run", scenario, "--fast", *out), of_a_log, "out/run.mcap", 0.2),
        "analyze": Writer(words("analyze", scenario, *out), of_a_run, "out/prediction.json", 0.05),
        "campaign": Writer(study, of_a_campaign, remade="out/worst/"),
    }


def visible(folder: Path) -> dict[str, bytes]:
    """Contents of all files but hidden ones, by name."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if path.is_file() and not any(part.startswith(".") for part in name.parts):
            found[str(name)] = path.read_bytes()
    return found


def same(writer: Writer, data: bytes, other: bytes | None) -> bool:
    if other is None or not writer.alike:
        return data == other
    return abs(len(data) - len(other)) <= writer.alike * len(other)


def fault(writer: Writer, folder: Path, disk: Any, at: int, how: str, state: dict[str, bytes]) -> str:
    """Write version 1 while call `at` fails; what is wrong with the way in which that ends."""
    disk.disk_fail(at, HOW[how])
    try:
        said = writer.write(folder, 1)
        disk.disk_fail(-1, 0)
        if how != "killed" and "could not be" not in (said or ""):
            return unsaid(writer, visible(folder), state)
    except (OSError, BadInput) as error:
        return "more than a line" * ("\n" in str(error) and how != "killed")
    except Refused as refused:
        code, said = refused.args
        fine = code in (2, 4) and "Traceback" not in said and any(map(is_error, said.splitlines()))
        return "" if fine or how == "killed" else f"exit code {code}: {said}"
    except Exception as error:  # a process that is killed raises nothing
        return f"{type(error).__name__}: {error}" * (how != "killed")
    finally:
        disk.disk_fail(-1, 0)
    return ""


def unsaid(writer: Writer, found: dict[str, bytes], state: dict[str, bytes]) -> str:
    """What a writer kept to itself that said of no trouble: all of version 1 must be there."""
    missing = sorted(state.keys() - found.keys())
    different = [name for name, data in found.items() if name in state and not same(writer, data, state[name])]
    different = [name for name in different if not in_store(Path(name))]
    return f"says nothing of {(missing + different)[0]}" if missing + different else ""


def is_error(line: str) -> bool:
    return line.startswith("Error: ")


def trouble(writer: Writer, folder: Path, states: list[dict[str, bytes]]) -> str:
    """What is wrong with the files after a fault; "" for nothing."""
    found = visible(folder)
    replaced = bool(writer.marker) and found.get(writer.marker) != states[0][writer.marker]
    for name in states[0].keys() - found.keys():
        if name in states[1] and not replaced and not name.startswith(writer.remade or "/"):
            return f"{name} is gone"
    for name, data in found.items():
        meant = name.replace(_RESCUED, "out/")  # what could not be moved to its place
        if not any(same(writer, data, state.get(meant)) for state in states) and (why := writer.whole(folder / name)):
            return f"{name}, {len(data)} bytes: {why}"
    return ""


def again(writer: Writer, folder: Path, state: dict[str, bytes]) -> str:
    """Write version 1 once more, on a disk that works; what is wrong with it."""
    try:
        writer.write(folder, 1)
    except (Exception, Refused) as error:
        return f"not again: {error.args}"
    found = {name: data for name, data in visible(folder).items() if not name.startswith(_RESCUED)}
    if found.keys() != state.keys():
        return f"again: {sorted(found.keys() ^ state.keys())}"
    different = [name for name, data in found.items() if not same(writer, data, state[name]) and in_store(Path(name))]
    return f"again: {different[0]}" if different else ""


def tried(name: str, writer: Writer, work: Path, most: int, disk: Any) -> dict[str, Any]:
    """Let calls of a writer fail, one at a time."""
    earlier, states = work.with_name("earlier"), []
    for version in (0, 1):
        work.mkdir(exist_ok=True)
        disk.disk_fail(-1, 0)
        writer.write(work, version)
        calls = disk.disk_fail(-1, 0)
        states.append(visible(work))
        if version == 0:
            shutil.copytree(work, earlier)
    assert states[0] != states[1] and states[0], name
    chosen = sorted({round(at) for at in np.linspace(0, calls - 1, min(calls, most))})
    wrong = []
    for how in HOW:
        for at in chosen:
            shutil.rmtree(work)
            shutil.copytree(earlier, work)
            why = fault(writer, work, disk, at, how, states[1]) or trouble(writer, work, states)
            if not why and "{version}" not in name:
                why = again_if_possible(writer, work, states)
            if why:
                wrong.append(f"call {at} of {calls}, {how}: {why}")
    return {"name": name, "calls": calls, "tried": len(chosen) * len(HOW), "wrong": wrong}


def again_if_possible(writer: Writer, work: Path, states: list[dict[str, bytes]]) -> str:
    """What must not be there already, such as a new bag, is not written again."""
    if states[1].keys() - states[0].keys() and visible(work).keys() >= states[1].keys():
        return ""
    return again(writer, work, states[1])


def main() -> None:
    root, most, names = Path(sys.argv[1]).resolve(), int(sys.argv[2]), sys.argv[3:]
    warnings.simplefilter("ignore")
    disk, known = ctypes.CDLL(None), writers(root / "inputs")
    for name in names or known:
        work = root / name.replace(" ", "") / "work"
        work.parent.mkdir()
        disk.disk_watch(str(work).encode())
        print(json.dumps(tried(name, known[name], work, most, disk)), flush=True)
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
