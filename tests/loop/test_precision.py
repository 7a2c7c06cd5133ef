"""Precision belongs to a run: whatever ran before it in the process, or runs beside it, its bits are the same."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import runtime
from undertow.core.contracts import Load, Pose
from undertow.core.numerics.rotations import cross
from undertow.physics.disturbances.u1 import u1
from undertow.scenario.reading import dump
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.campaign.campaign_schema import read_text
from undertow.studies.campaign.store_layout import layout
from undertow.studies.campaign.task import run_trials, task_context

SCENARIO = {
    "plant": {"kind": "double_integrator", "limit": 20.0},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 1.0, "dt": 0.01, "record": 0.02},
}
PROGRAM = """
import sys
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.reading import read
from pathlib import Path
print(run_scenario(read(Path(sys.argv[1]))).dataset.attrs["content_hash"])
"""


def scenario(precision, backend="simd"):
    return SCENARIO | {"precision": precision, "loop": SCENARIO["loop"] | {"backend": backend}}


def content(precision, backend="simd"):
    found = run_scenario(scenario(precision, backend))
    assert found.outcome.signals["position"].dtype == precision == str(found.dataset["position"].dtype)
    return found.dataset.attrs["content_hash"]


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """Content hashes by precision, each of a process that does nothing else."""
    folder = tmp_path_factory.mktemp("fresh")

    def alone(precision):
        path = folder / f"{precision}.yaml"
        path.write_text(dump(scenario(precision)), encoding="utf-8")
        command = [sys.executable, "-c", PROGRAM, str(path)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    return {precision: alone(precision) for precision in ("float64", "float32")}


@pytest.mark.slow
def test_one_after_the_other(fresh):
    assert fresh["float64"] != fresh["float32"]
    for precision in ("float64", "float32", "float64"):
        assert content(precision) == fresh[precision]
        assert jax.config.jax_enable_x64, "a run leaves the process as it was"


@pytest.mark.slow
def test_beside_each_other(fresh):
    """Two threads, each going from one precision to the other against the other one."""
    orders = [("float64", "float32"), ("float32", "float64")]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda order: [content(precision) for precision in order], orders))
    assert found == [[fresh[precision] for precision in order] for order in orders]


@pytest.mark.slow
def test_by_xla_too():
    double = content("float64", "xla")
    assert content("float32", "xla") != double == content("float64", "xla")


@pytest.mark.full
def test_a_campaign_across_precisions():
    """Each trial as in a campaign of its precision alone; tasks of one precision only do not decide about the columns."""
    campaign = {"scenario": SCENARIO, "trials": 3, "chunk": 2, "seed": 7}
    campaign["vary"] = {"disturbance.amplitude": {"uniform": [0.5, 2.0]}}
    alone = {
        precision: run_trials(dump(campaign | {"scenario": scenario(precision)}), "", range(3))
        for precision in ("float64", "float32")
    }
    text = dump(campaign | {"cross": {"precision": list(alone)}})
    where = layout(read_text(text, None)[0])
    assert where.tasks == 4
    for task in range(where.tasks):
        rows = where.trials(task).tolist()
        found = run_trials(text, "", rows)
        assert found["position_rms"].dtype == np.float64
        for place, row in enumerate(rows):
            trial, combination = divmod(row, 2)
            for name in ("position_rms", "input_variation", "input_rms"):
                assert found[name][place] == alone[list(alone)[combination]][name][trial], name
    task_context.cache_clear()


def test_constants_of_parts_follow():
    """JAX remembers what NumPy arrays were made into: constants of u1 and of rotations are made anew in each precision."""
    place = Pose(jnp.zeros(3), jnp.eye(3), jnp.zeros(3))
    load = jax.jit(lambda t, calm: u1().at((), t, place, calm).acceleration)
    for precision in ("float64", "float32", "float64"):
        with runtime.in_precision(precision):
            calm = Load(jnp.zeros(6), jnp.zeros(6))
            assert str(load(jnp.asarray(0.5), calm).dtype) == precision
            turned = jax.jit(cross)(jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0]))
            np.testing.assert_array_equal(turned, [0.0, 0.0, 1.0])
            assert str(turned.dtype) == precision


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_threads_of_a_run_compute_in_its_precision(precision):
    with runtime.in_precision(precision), runtime.workers(2) as threads:
        assert {str(kind) for kind in threads.map(lambda _: jnp.zeros(1).dtype, range(4))} == {precision}
