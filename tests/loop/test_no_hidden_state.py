"""Importing undertow changes nothing in the process; precision belongs to a run, and the caller's settings stay."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.scenario.reading import dump
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.campaign.task import run_trials, task_context

# What other packages do to a process when they are imported is theirs; they are imported before.
PROCESS = """
import json, logging, os, signal, sys, threading, warnings
import jax, matplotlib, numpy, xarray, netCDF4, diffrax, pydantic, ruamel.yaml, scipy.stats, zarr

def state():
    return {
        "jax": {key: str(value) for key, value in jax.config.values.items()},
        "environment": dict(os.environ),
        "warnings": [str(entry) for entry in warnings.filters],
        "signals": [str(signal.getsignal(one)) for one in signal.valid_signals()],
        "logging": [logging.root.level, str(logging.root.handlers), logging.root.manager.disable],
        "matplotlib": {key: str(matplotlib.rcParams[key]) for key in matplotlib.rcParams if key != "backend"},
        "numpy": [numpy.geterr(), str(numpy.get_printoptions())],
        "threads": [thread.name for thread in threading.enumerate()],
        "others": [sys.getrecursionlimit(), sys.getswitchinterval(), str(sys.excepthook), os.getcwd(), os.umask(0o22)],
    }

before, changed = state(), []
def look(what):
    now = state()
    changed.extend(f"{what}: {kind}" for kind in before if now[kind] != before[kind])
    before.update(now)
"""
EVERYTHING = """
import undertow
look("import undertow")
for name in dir(undertow):
    getattr(undertow, name)
    look(name)
import importlib, pkgutil
import control, cyclonedds, gymnasium, mcap, pymavlink, pyulog, rosbags
import dask, distributed, rich, scipy.linalg, scipy.optimize, scipy.signal, scipy.sparse, scipy.stats, typer, zarr
before.update(state())
for package in ("undertow", "simdjit"):
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
        if module.name != "undertow.studies.speed.first" and "mujoco_engine" not in module.name:  # a program; an extra
            __import__(module.name)
            look(module.name)
print(json.dumps(changed))
"""
SCENARIO = {
    "plant": {"kind": "double_integrator", "limit": 20.0},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 0.7},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 0.5, "dt": 0.01, "record": 0.02},
}
PRECISIONS = ("float64", "float32")


@pytest.mark.full
def test_importing_changes_nothing():
    """Neither the package, nor any public name, nor any module by itself."""
    done = subprocess.run([sys.executable, "-c", PROCESS + EVERYTHING], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"


def by_parts(precision):
    """Parts made by the caller, outside of any run."""
    plant = ut.plants.double_integrator(limit=20.0)
    law = ut.controllers.pid(plant.model(), frequency=2.0, sampling_time=0.01)
    run = ut.simulate(
        plant,
        law,
        ut.references.setpoint([1.0]),
        disturbance=ut.disturbances.sinusoid(amplitude=0.7),
        navigation=ut.navigation.white_noise(velocity=0.01),
        duration=0.5,
        dt=0.01,
        record=0.02,
        seed=3,
        precision=precision,
    )
    return [run.dataset["position"].values, run.metrics["whole"]["input_variation"]]


def by_scenario(precision):
    found = run_scenario(SCENARIO | {"precision": precision, "seed": 3})
    return [found.dataset["position"].values, found.whole["input_variation"]]


def by_xla(precision):
    found = run_scenario(SCENARIO | {"precision": precision, "seed": 3, "loop": SCENARIO["loop"] | {"backend": "xla"}})
    return [found.dataset["position"].values, found.whole["input_variation"]]


def by_campaign(precision):
    vary = {"disturbance.amplitude": {"uniform": [0.5, 2.0]}}
    campaign = {"scenario": SCENARIO | {"precision": precision}, "trials": 2, "seed": 7, "vary": vary}
    columns = run_trials(dump(campaign), "", range(2))
    return [columns["input_variation"], columns["position_rms"]]


WAYS = {"parts": by_parts, "scenario": by_scenario, "xla": by_xla, "campaign": by_campaign}


def same(found, wanted):
    for one, other in zip(found, wanted, strict=True):
        assert np.asarray(one).dtype == np.asarray(other).dtype
        np.testing.assert_array_equal(one, other)


@pytest.fixture(scope="module")
def alone():
    """Each way and precision by itself, by a caller who computes in double precision."""
    found = {}
    for way, run in WAYS.items():
        for precision in PRECISIONS:
            task_context.cache_clear()
            found[way, precision] = run(precision)
    return found


@pytest.mark.parametrize(
    ("double", "ways"),
    [
        pytest.param(False, ("xla", "campaign"), marks=pytest.mark.full),
        pytest.param(False, ("parts", "scenario"), marks=pytest.mark.slow),
        pytest.param(True, tuple(WAYS), marks=pytest.mark.slow),
    ],
)
def test_precisions_interleaved_in_threads(alone, double, ways):
    """Two callers in two threads go through the ways against one another; both have their setting before and after."""
    task_context.cache_clear()

    def caller(order):
        with jax.enable_x64(double):
            for way in ways:
                for precision in order:
                    same(WAYS[way](precision), alone[way, precision])
                    assert jax.config.jax_enable_x64 is double
                    assert jax.numpy.ones(()).dtype == ("float64" if double else "float32")

    before = jax.config.jax_enable_x64
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(caller, [PRECISIONS, PRECISIONS[::-1]]))
    assert jax.config.jax_enable_x64 is before


@pytest.mark.full
def test_the_two_precisions_differ(alone):
    for way in WAYS:
        assert not np.array_equal(alone[way, "float64"][0], alone[way, "float32"][0]), way
    assert alone["parts", "float32"][0].dtype == np.float32


@pytest.mark.full
def test_parts_and_scenario_agree(alone):
    """The same loop given in two ways: bit for bit, in either precision."""
    for precision in PRECISIONS:
        same(alone["parts", precision][:1], alone["scenario", precision][:1])


def test_a_precision_that_is_none():
    with pytest.raises(BadInput, match="`precision` must be one of float64, float32"):
        by_parts("float16")


BY_ITSELF = """
import sys, warnings
import numpy as np
import undertow as ut

if sys.argv[1] == "prepared":
    ut.prepare()
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    made = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.t200())  # making parts computes in double, and says nothing
    made.model()
    assert not said, said
    thruster = ut.thrusters.t200()
    state = thruster.initial_state(2)
if sys.argv[1] == "late":
    ut.prepare()
rate = thruster.dynamics(thruster.initial_state(2), np.full(2, 8.0))
print(len(said), any("undertow.prepare" in str(one.message) for one in said), rate.speed.dtype)
"""


@pytest.mark.full
@pytest.mark.parametrize(
    ("when", "printed"), [("never", "1 True float32"), ("prepared", "0 False float64"), ("late", "1 True float64")]
)
def test_a_part_by_itself_says_that_it_is_in_single_precision(when, printed):
    """A fit stopped early in single precision, without a word; `prepare` makes it double, also once JAX is there."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("JAX_", "XLA_"))}
    command = [sys.executable, "-W", "ignore", "-c", BY_ITSELF, when]
    found = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert found.stdout.strip() == printed
