"""The batch compiler is optional: without it everything runs by XLA, and whoever falls back says why, once."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from undertow.cli.main import run
from undertow.core import batch_compiler, process_setup
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop import simd_batch
from undertow.studies.speed import measure

SCENARIO = """
plant: {kind: double_integrator, axes: 1, limit: 20.0}
controller: {kind: pid, frequency: 2.0}
reference: {kind: setpoint, position: [1.0]}
disturbance: {kind: sinusoid, amplitude: 0.7}
loop: {duration: 0.5, dt: 0.01, record: 0.02}
steady: {start: 0.1}
"""
CAMPAIGN = "scenario: scenario.yaml\ntrials: 3\nvary: {disturbance.amplitude: {uniform: [0.5, 2.0]}}\n"
WITHOUT = """
import json, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in HIDDEN:
            raise ImportError(f"No module named '{name}'", name=name)

HIDDEN = set(sys.argv[1].split())
sys.meta_path.insert(0, Blocked())
from undertow.cli.main import run
for command in json.loads(sys.argv[2]):
    code = run(command)
    assert not HIDDEN & set(sys.modules)
    sys.stderr.flush()
    print("\\n--", code, file=sys.stderr, flush=True)
"""
COMMANDS = {
    "simulate": ["scenario.yaml", "--out", "run", "--no-prediction"],
    "campaign": ["campaign.yaml", "--out", "trials"],
    "check": ["scenario.yaml"],
    "list": [],
    "analyze": ["scenario.yaml", "--out", "prediction"],
    "export": ["scenario.yaml", "--c99", "code", "--part", "vehicle"],
}


def without(hidden, folder, *names):
    """Exit code and standard error of commands, one after another in a process where some packages cannot be imported."""
    (folder / "scenario.yaml").write_text(SCENARIO)
    (folder / "campaign.yaml").write_text(CAMPAIGN)
    command = [sys.executable, "-c", WITHOUT, hidden, json.dumps([[name, *COMMANDS[name]] for name in names])]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    parts = re.findall(r"(.*?)\n-- (\d+)\n", done.stderr, re.DOTALL)
    return {name: (int(code), said) for name, (said, code) in zip(names, parts, strict=True)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("without")


@pytest.fixture(scope="module")
def done(folder):
    return without("simdjit", folder, "simulate", "campaign", "check", "list", "export")


def compare_runs(folder, code, said, hidden):
    """The figures of backend simd to rounding, and the reason on the terminal and in the result."""
    import xarray as xr

    assert code == 0, said
    assert said.count("the run used backend xla") == 1
    assert f"the batch compiler cannot be imported (No module named '{hidden}')" in " ".join(said.split())
    with xr.open_dataset(folder / "run" / "run.nc") as found:
        assert "`pip install .`" in found.attrs["left_to_xla"]
        wanted = execute_file(folder)
        np.testing.assert_allclose(found["position"], wanted["position"], rtol=1e-9, atol=1e-12)


@pytest.mark.full
def test_simulate(folder, done):
    compare_runs(folder, *done["simulate"], "simdjit")


@pytest.mark.slow
def test_simulate_without_llvm(tmp_path):
    compare_runs(tmp_path, *without("llvmlite", tmp_path, "simulate")["simulate"], "llvmlite")


def execute_file(folder):
    from undertow.scenario.reading import read

    executed = run_scenario(read(folder / "scenario.yaml"))
    assert "left_to_xla" not in executed.dataset.attrs
    return executed.dataset


@pytest.mark.full
def test_campaign(done):
    code, said = done["campaign"]
    assert code == 0, said
    assert said.count("trials are computed by backend xla") == 1
    assert "the batch compiler cannot be imported" in " ".join(said.split())


@pytest.mark.slow
def test_analyze(tmp_path):
    code, said = without("simdjit", tmp_path, "analyze")["analyze"]
    assert code == 0, said


@pytest.mark.full
def test_bench_leaves_out_what_it_cannot_measure(monkeypatch, capsys):
    """The other figures stand, and the reason."""
    monkeypatch.setattr(measure, "unavailable", lambda: "there is no compiler")
    monkeypatch.setattr(measure, "_first_results", lambda: (2.0, 1.0))
    monkeypatch.setattr(measure, "_by_xla", lambda one: {"single_xla_compile_s": 3.0, "single_xla_ns": 2000.0})
    monkeypatch.setattr(measure, "_shortest", lambda work, repetitions=1: 2000.0 * 6e5)
    assert run(["bench"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Figures of SIMD batches are left out: there is no compiler." in said
    assert "one run, XLA backend" in said and "one run in plain NumPy" in said and "many runs" not in said
    assert run(["bench", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["simd_unavailable"] == "there is no compiler"
    assert found["numpy_ns"] == 6e5 and found["single_xla_ns"] == 2000.0
    assert not [key for key in found if key.startswith(("single_ns", "batch", "gpu", "w2"))]


@pytest.mark.full
def test_check_and_list(done):
    assert done["check"][0] == done["list"][0] == 0


@pytest.mark.full
def test_nothing_is_exported(folder, done):
    code, said = done["export"]
    assert code == 2 and not (folder / "code").exists()
    assert "Nothing can be exported: the batch compiler cannot be imported" in " ".join(said.split())


@pytest.mark.full
def test_few_modules_know_the_compiler():
    """One makes it known, two use its cache; and all of them only its public face."""
    import ast
    from pathlib import Path

    import simdjit

    root, found = Path(process_setup.__file__).parents[1], {}
    for path in root.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported = [(alias.name, "") for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                imported = [(node.module or "", alias.name) for alias in node.names]
            else:
                continue
            for module, name in imported:
                if module.split(".")[0] in ("simdjit", "llvmlite"):
                    found.setdefault(str(path.relative_to(root)), set()).add((module, name))
    assert set(found) == {"core/batch_compiler.py", "core/kept_code.py", "core/kept_programs.py"}
    used = set.union(*found.values())
    assert all(module == "simdjit" and (not name or hasattr(simdjit, name)) for module, name in used)


def test_where_there_is_one():
    assert batch_compiler.unavailable() == ""
    assert simd_batch.simd_width(64) == 2 * simd_batch.simd_width(128) > 1


def test_code_of_xla_is_kept_where_nobody_else_may_write(tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("JAX_COMPILATION_CACHE_DIR", raising=False)
    process_setup._keep_xla_code()
    place = os.environ.pop("JAX_COMPILATION_CACHE_DIR")
    assert os.stat(place).st_mode & 0o077 == 0
    os.chmod(place, 0o777)
    process_setup._keep_xla_code()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ
