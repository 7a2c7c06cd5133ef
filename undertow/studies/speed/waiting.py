"""How long users wait: commands in processes of their own, with empty caches and after a change of one number."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.studies.speed.measure import Watch, with_cache
from undertow.studies.speed.workload import W2


class Case(NamedTuple):
    """A scenario, and the same with one number changed."""

    scenario: Mapping[str, Any]
    changed: Mapping[str, Any]


def _changed(scenario: Mapping[str, Any], section: str, value: Any) -> Case:
    return Case(scenario, {**scenario, section: value})


# examples/bluerov2_heavy.yaml, paper_example1.yaml and inverted_pendulum.yaml.
_HEAVY = W2 | {"plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}}}
_EXAMPLE_1: dict[str, Any] = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "ideal"}},
    "model": {"speed_sensor": True},
    "controller": {"kind": "paper"},
    "reference": {
        "kind": "setpoint",
        "position": [2, 3, 4, 1.0471975511965976, 0.7853981633974483, 1.2566370614359172],
    },
    "disturbance": "u1",
    "loop": {"kind": "continuous", "duration": 20},
}
_PENDULUM: dict[str, Any] = {
    "plant": "inverted_pendulum",
    "model": {"half_length": 0.35},
    "controller": "paper",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05235987755982988]},
    "loop": {"duration": 20},
}
CASES = {
    "heavy": _changed(_HEAVY, "reference", {"kind": "setpoint", "position": [2, 1, 1.1, 0, 0, 0.5], "settling": 20}),
    "example1": _changed(_EXAMPLE_1, "controller", {"kind": "paper", "composite": 450}),
    "pendulum": _changed(_PENDULUM, "reference", {"kind": "sine", "amplitude": 0.12, "frequency": 1}),
}
_COMPARED = "robust,pid,adrc"
_COMMAND = (sys.executable, "-m", "undertow")
_JAX = (sys.executable, "-c", "import jax; jax.jit(lambda x: x + 1)(1.0)")


def waiting_times(
    watch: Watch, cases: Mapping[str, Case] = CASES, compared: Sequence[str] = ("heavy",)
) -> dict[str, float]:
    """Seconds that commands take: until the metrics of `simulate` are printed, and until all files are written.

    Args:
        watch: is called with the stage.
        cases: to be simulated.
        compared: names of cases on which `compare` runs three controllers, with everything compiled before.

    Raises:
        CalledProcessError: a command failed.
    """
    times = {}
    stages = [*cases, *compared]
    watch("start of JAX", 0.0)
    times["jax_start_s"] = _seconds(_JAX, Path(), dict(os.environ))[1]
    for i, (name, case) in enumerate(cases.items()):
        with tempfile.TemporaryDirectory() as folder:
            settings = _settings(Path(folder))
            for when, scenario in (("cold", case.scenario), ("changed", case.changed)):
                watch(f"{name}, {when}", i / len(stages))
                results, files = _simulated(Path(folder), settings, scenario)
                times |= {f"{name}_{when}_results_s": results, f"{name}_{when}_files_s": files}
    for i, name in enumerate(compared):
        with tempfile.TemporaryDirectory() as folder:
            settings = _settings(Path(folder))
            (Path(folder) / "scenario.yaml").write_text(json.dumps(cases[name].scenario), encoding="utf-8")
            for when in ("cold", "warm"):
                watch(f"{name}, comparison, {when}", (len(cases) + i) / len(stages))
                command = (*_COMMAND, "compare", "scenario.yaml", "--controllers", _COMPARED, "--out", when)
                times[f"{name}_compare_{when}_s"] = _seconds(command, Path(folder), settings)[1]
    watch("", 1.0)
    return times


def _settings(folder: Path) -> dict[str, str]:
    """Environment of a process whose caches lie in a folder."""
    return with_cache(str(folder / "cache")) | {"PYTHONUNBUFFERED": "1"}


def _simulated(folder: Path, settings: dict[str, str], scenario: Mapping[str, Any]) -> tuple[float, float]:
    (folder / "scenario.yaml").write_text(json.dumps(scenario), encoding="utf-8")  # JSON is YAML
    command = (*_COMMAND, "simulate", "scenario.yaml", "--out", "out", "--overwrite")
    return _seconds(command, folder, settings, until="It ")


def _seconds(command: Sequence[str], folder: Path, settings: dict[str, str], until: str = "") -> tuple[float, float]:
    """Seconds until a process prints a line that begins with `until`, and until it ends."""
    started = time.perf_counter()
    printed = float("nan")
    options: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen(command, cwd=folder, env=settings, **options) as process:
        for line in process.stdout or ():
            if until and line.startswith(until):
                printed = time.perf_counter() - started
    if process.returncode != 0:
        raise subprocess.CalledProcessError(process.returncode, command)
    return printed, time.perf_counter() - started
