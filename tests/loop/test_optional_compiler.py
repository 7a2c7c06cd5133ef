"""The batch compiler is optional: without it everything runs by XLA, and whoever falls back says why, once."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from undertow import process
from undertow.bench import measure
from undertow.cli.main import run
from undertow.loop import simd_batch
from undertow.scenario.execute import execute

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
code = run(json.loads(sys.argv[2]))
assert not HIDDEN & set(sys.modules)
sys.exit(code)
"""


def without(hidden, folder, *arguments):
    """A command where some packages cannot be imported."""
    command = [sys.executable, "-c", WITHOUT, hidden, json.dumps(arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scenario.yaml").write_text(SCENARIO)
    (tmp_path / "campaign.yaml").write_text(CAMPAIGN)
    return tmp_path


@pytest.mark.parametrize("hidden", ["simdjit", pytest.param("llvmlite", marks=pytest.mark.slow)])
def test_simulate(folder, hidden):
    """The figures of backend simd to rounding, and the reason on the terminal and in the result."""
    import xarray as xr

    done = without(hidden, folder, "simulate", "scenario.yaml", "--out", "run")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("the run used backend xla") == 1
    assert f"the batch compiler cannot be imported (No module named '{hidden}')" in " ".join(done.stderr.split())
    with xr.open_dataset(folder / "run" / "run.nc") as found:
        assert "`pip install .`" in found.attrs["left_to_xla"]
        wanted = execute_file(folder)
        np.testing.assert_allclose(found["position"], wanted["position"], rtol=1e-9, atol=1e-12)


def execute_file(folder):
    from undertow.scenario.reading import read

    executed = execute(read(folder / "scenario.yaml"))
    assert "left_to_xla" not in executed.dataset.attrs
    return executed.dataset


def test_campaign(folder):
    done = without("simdjit", folder, "campaign", "campaign.yaml", "--out", "trials")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("trials are computed by backend xla") == 1
    assert "the batch compiler cannot be imported" in " ".join(done.stderr.split())


@pytest.mark.slow
def test_analyze(folder):
    done = without("simdjit", folder, "analyze", "scenario.yaml", "--out", "prediction")
    assert done.returncode == 0, done.stderr


def test_bench_leaves_out_what_it_cannot_measure(monkeypatch, capsys):
    """The other figures stand, and the reason."""
    monkeypatch.setattr(simd_batch, "unavailable", lambda: "there is no compiler")
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


def test_check_and_list(folder):
    assert without("simdjit", folder, "check", "scenario.yaml").returncode == 0
    assert without("simdjit", folder, "list").returncode == 0


def test_one_module_knows_the_compiler():
    """And of the compiler only its public face."""
    import ast
    from pathlib import Path

    import simdjit

    root, found = Path(process.__file__).parent, {}
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
    assert set(found) == {"loop/simd_batch.py"}
    assert all(
        module == "simdjit" and (not name or hasattr(simdjit, name)) for module, name in found["loop/simd_batch.py"]
    )


def test_where_there_is_one():
    assert simd_batch.unavailable() == ""
    assert simd_batch.simd_width(64) == 2 * simd_batch.simd_width(128) > 1


def test_code_of_xla_is_kept_where_nobody_else_may_write(tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("JAX_COMPILATION_CACHE_DIR", raising=False)
    process._keep_xla_code()
    place = os.environ.pop("JAX_COMPILATION_CACHE_DIR")
    assert os.stat(place).st_mode & 0o077 == 0
    os.chmod(place, 0o777)
    process._keep_xla_code()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ
