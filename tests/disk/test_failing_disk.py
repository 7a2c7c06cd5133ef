"""A fault at every call that changes the disk: earlier results stay whole or the new ones are, and the next try succeeds."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
COMPILER = next((name for name in ("gcc", "clang", "cc") if shutil.which(name)), "cc")

# In few seconds each, and commands, which take longer.
FUNCTIONS = ("run.nc", "knowledge", "checkpoint", "export", "bag, mcap", "bag, sqlite3", "rerun")
COMMANDS = ("log, mcap", "log, csv", "layout", "init", "simulate", "run", "analyze", "campaign")


@pytest.fixture(scope="session")
def shim(tmp_path_factory):
    library = tmp_path_factory.mktemp("disk") / "failing_disk.so"
    command = [COMPILER, "-O1", "-Wall", "-Werror", "-shared", "-fPIC", HERE / "failing_disk.c", "-o", library, "-ldl"]
    subprocess.run(command, check=True)
    return library


def found(shim, folder, most, *names):
    """What a process of its own finds, in which the disk fails; by writer."""
    environment = os.environ | {"LD_PRELOAD": str(shim)}
    command = [sys.executable, HERE / "writers.py", folder, str(most), *names]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith('{"name"')]


def check(results, names):
    assert [one["name"] for one in results] == list(names)
    assert not [f"{one['name']}: {why}" for one in results for why in one["wrong"]]
    assert all(one["tried"] >= 6 for one in results)


@pytest.mark.full
def test_files_on_a_failing_disk(shim, tmp_path):
    """A few calls of each: the first, the last, and some between."""
    names = ("knowledge", "checkpoint", "export")
    check(found(shim, tmp_path, 8, *names), names)


@pytest.mark.full
@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_call_of_a_function(shim, tmp_path, name):
    check(found(shim, tmp_path, 40, name), [name])


@pytest.mark.full
@pytest.mark.parametrize("name", COMMANDS)
def test_calls_of_a_command(shim, tmp_path, name):
    check(found(shim, tmp_path, 8, name), [name])


# Where a file may be written in place, and why that costs nobody a result.
IN_PLACE = {
    "undertow/core/atomic_io.py": "the one writer",
    "undertow/studies/speed/waiting.py": "a temporary folder",
    "undertow/core/process_setup.py": "its own file, which takes another's place, before JAX is imported",
    "undertow/outside/export/fmu.py": "a temporary folder for the compiler",
    "undertow/outside/browser/wasm.py": "a temporary folder for the compiler",
    "undertow/logs/csv_writer.py": "`Log.save` gives it a new file",
    "undertow/logs/mcap_writer.py": "`Log.save` gives it a new file; a log that is being written has a new name",
    "undertow/simulation/checkpoint.py": "lines are added; one that is incomplete is left out",
    "undertow/cli/tune.py": "a draft of the results folder",
    "undertow/cli/falsify.py": "a draft of the results folder",
    "undertow/cli/analyze.py": "a draft of the results folder",
    "undertow/cli/identify.py": "a draft of the results folder",
    "undertow/cli/identify_design.py": "a draft of the results folder",
    "undertow/cli/identify_thruster.py": "a draft of the results folder",
    "undertow/cli/log_score.py": "a draft of the results folder",
    "undertow/cli/campaign.py": "a folder that takes another's place",
    "undertow/cli/compare.py": "a folder that takes another's place",
    "undertow/scenario/results/netcdf.py": "a draft of the results folder",
    "undertow/logs/unpacking.py": "a temporary folder",
    "undertow/report/plotted.py": "a draft of the results folder",
    "undertow/report/prediction_page.py": "a draft of the results folder",
}


def test_files_are_written_by_the_one_writer():
    pattern = re.compile(r"\.write_(text|bytes)\(|\.open\(\"[wax]|open\([^)]*\"[wax]b?\"")
    files = [path for path in (ROOT / "undertow").rglob("*.py")]
    writing = {str(path.relative_to(ROOT)) for path in files if pattern.search(path.read_text(encoding="utf-8"))}
    assert not writing - IN_PLACE.keys(), "use `write_whole` or `replacing` of undertow/core/atomic_io.py"
