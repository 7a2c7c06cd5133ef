"""SIMD batches of closed loops on a GPU: NVIDIA's assembly, and its threads, for which this processor stands in."""

import re

import equinox as eqx
import jax
import numpy as np
import pytest
from emulated_gpu import EmulatedGpu
from loop.test_simd_examples import example

from simdjit import Driver, nvidia
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.loop.simd_batch import SimdBatchRunner
from undertow.studies.speed.workload import constant


@pytest.fixture
def gpu(monkeypatch):
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, *rest: assembly)
    return EmulatedGpu()


def several(name, steps, runs, every=0):
    """A run of an example, how it is run, which numbers are the same, and numbers of runs from different places."""
    loop, how = example(name)
    run = LoopRun(loop, how["accumulators"], loop.outputs_at_start(None, None), how["key"])
    plan = RunPlan(steps, how["dt"], every, ("position", "input"), how["method"], how["substeps"])
    numbers = eqx.filter(run, eqx.is_array)
    many = jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (runs, *leaf.shape)), numbers)
    places = np.random.default_rng(0).normal(scale=0.05, size=(runs, *run.start[0].shape))
    same = constant(run)
    return run, plan, same, many._replace(start=(places, many.start[1]))


@pytest.mark.full
@pytest.mark.parametrize(
    "name, steps, runs, every",
    [
        pytest.param(
            "inverted_pendulum", 40, 133, 10, marks=pytest.mark.full
        ),  # two blocks, the second with threads that have no run
        ("inverted_pendulum", 40, 5, 0),
        pytest.param("w1", 20, 33, 5, marks=pytest.mark.slow),
        pytest.param("bluerov2_heavy", 20, 3, 5, marks=pytest.mark.slow),  # loops, branches and random numbers
    ],
)
def test_threads_give_the_bits_of_vectors(gpu, name, steps, runs, every):
    run, plan, same, many = several(name, steps, runs, every)
    found = SimdBatchRunner(run, plan, same, driver=Driver(gpu)).run(many)
    wanted = SimdBatchRunner(run, plan, same).run(many)
    jax.tree.map(np.testing.assert_array_equal, found, wanted)
    assert gpu.launches == [(-(-(-(-runs // 32) * 32) // 128), 128)]
    assert not gpu.buffers


@pytest.mark.parametrize(
    "generation", [pytest.param(80, marks=pytest.mark.slow), pytest.param(90, marks=pytest.mark.full)]
)
def test_nothing_is_approximate(monkeypatch, generation):
    written = []
    monkeypatch.setattr(Driver, "load", lambda self, assembly, name: written.append(assembly))
    run, plan, same, _ = several("w1", 5, 1, 5)
    driver = Driver(EmulatedGpu())
    driver.generation = generation
    SimdBatchRunner(run, plan, same, driver=driver)
    (text,) = written
    assert f".target sm_{generation}" in text and ".entry run" in text
    assert not re.findall(r"\b(approx|ftz|mad\.f\d+)\b", text)
    rounded = set(re.findall(r"\t((?:mul|add|sub|div|sqrt|rcp|fma)\.\S*f\d+)", text))
    assert rounded == {f"{name}.rn.f64" for name in ("mul", "add", "sub", "div", "sqrt", "rcp", "fma")}


def test_memory_that_is_not_there_is_told_and_the_rest_given_back(gpu):
    run, plan, same, many = several("inverted_pendulum", 10, 64)
    gpu.left = 4000
    with pytest.raises(OSError, match=r"driver refuses cuMemAlloc_v2 \(CUDA error 2\)"):
        SimdBatchRunner(run, plan, same, driver=Driver(gpu)).run(many)
    assert not gpu.buffers and gpu.left == 4000
