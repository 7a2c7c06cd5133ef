"""Workloads W1 and W2 are what they are said to be, and `undertow bench` tells them."""

import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emulated_gpu import EmulatedGpu

from simdjit import Driver, Loop, nvidia
from undertow.cli.main import run
from undertow.scenario.build import build
from undertow.scenario.reading import read
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop import sampled
from undertow.studies.speed import measure, plain_numpy, workload

pytestmark = pytest.mark.full

EXAMPLES = Path(__file__).parents[2] / "examples"

W1 = workload.workload(workload.W1)


def short(one, steps):
    return one._replace(plan=one.plan._replace(steps=steps))


@pytest.mark.slow
def test_the_workload_is_that_of_plain_numpy():
    """Mean square of the error over the second half of the first second: two programs that share no code."""
    late = eqx.tree_at(lambda run: (run.accumulators[0].start, run.accumulators[0].stop), W1.run, (0.4995, 0.9995))
    batch = workload.batch(short(workload.Workload(late, W1.plan), 1000))
    found = workload.tracking(batch.run(workload.alone(late)).accumulated)[0]
    bounded = np.sqrt(plain_numpy.workload_w1(1000))
    assert found == pytest.approx(bounded, rel=1e-9)
    assert abs(np.sqrt(plain_numpy.workload_w1(1000, bound=np.inf)) / bounded - 1) > 1e-3, "the bound is met"


@pytest.mark.slow
def test_runs_of_a_batch_start_from_different_places():
    run = W1.run
    rms = workload.tracking(workload.batch(short(W1, 11_000)).run(workload.several(run, 9)).accumulated)
    assert len(set(rms)) == 9
    places = workload.several(run, 9).start
    at = {"position": places[0][4], "velocity": places[1][4]}
    wanted = sampled.simulate(run.loop, duration=11.0, record_every=0, accumulators=run.accumulators, **at)
    assert rms[4] == pytest.approx(workload.tracking(wanted.accumulated), rel=1e-9)


@pytest.mark.parametrize(
    ("data", "example", "steps"),
    [(workload.W1, "w1", 20_000), pytest.param(workload.W2, "bluerov2_heavy", 12_000, marks=pytest.mark.slow)],
)
def test_workloads_are_the_examples(data, example, steps):
    """Benchmark, section 7: W1 with bounded weights, W2 what users run; part by part what the example describes."""
    theirs, ours = build(read(EXAMPLES / f"{example}.yaml")), build(data)
    for one, other in zip(*(jax.tree.leaves(each.closed_loop) for each in (ours, theirs)), strict=True):
        np.testing.assert_array_equal(one, other)
    mine = workload.workload(data)
    assert mine.steps == steps == round(theirs.scenario.loop.duration / theirs.scenario.loop.dt)
    assert mine.plan.dt == theirs.scenario.loop.dt and mine.plan.every == 0


def test_operations_are_counted():
    """Adding one axis to six adds a sixth of what the law does; a loop of plain arithmetic is counted by hand."""
    program = lambda step: Loop(
        lambda numbers: numbers, lambda known: known, step, lambda known, carry, k: carry, jnp.ones(3), [False]
    )
    assert program(lambda known, carry, k: carry * 2.5 + known).operations == 6
    assert program(lambda known, carry, k: carry + jnp.sin(known)).operations == 3, "sin(known) is done before"
    halved = lambda known, carry, k: jax.lax.while_loop(lambda x: x[0] > known[0], lambda x: x * 0.5, carry)
    assert program(halved).operations == 4, "one round of the loop: three products and the test"
    assert workload.batch(short(W1, 1), width=1).operations > 2_000


@pytest.mark.slow
def test_what_a_gpu_would_do(monkeypatch):
    """What is measured on a GPU, by threads, for which this processor stands in."""
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, *rest: assembly)
    found = measure.on_gpu(short(W1, 5), Driver(EmulatedGpu()), runs=40)
    assert found["ns"] > 0 and found["steps_per_second"] == pytest.approx(1e9 / found["ns"])


@pytest.mark.slow
def test_what_jax_would_do_on_a_gpu():
    """The other way to measure: by `jax.vmap`, a narrow program here."""
    assert measure.vmapped_ns(short(W1, 5), runs=3) > 0


def recorded_rms(example):
    """Rms of all errors over the second half of an example, from its records, computed by XLA."""
    text = read(EXAMPLES / f"{example}.yaml")
    run = run_scenario(text._replace(data=text.data | {"loop": text.data["loop"] | {"backend": "xla"}})).dataset
    late = run["error"].sel(time=run["time"] >= run["time"][-1] / 2)
    return np.sqrt(np.mean(late.values**2))


@pytest.mark.slow
def test_bench(capsys):
    assert run(["bench", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["tracking_rms"] == pytest.approx(0.004575, abs=1e-6)
    assert found["single_times_numpy"] == pytest.approx(found["numpy_ns"] / found["single_ns"], rel=1e-4)
    assert found["first_cold_s"] > found["first_kept_s"] > 0
    assert found["batch_float64_ns"] < found["single_ns"] < found["numpy_ns"]
    assert found["w2_tracking_rms"] == pytest.approx(recorded_rms("bluerov2_heavy"), rel=1e-3)
    assert found["w2_steps"] == 12_000
    assert found["w2_batch_float64_operations"] > found["batch_float64_operations"] > 2_000
    assert run(["bench"]) == 0
    said = capsys.readouterr().out
    assert "plain NumPy" in said and "W2" in said and "operations per step" in said
    assert jax.config.jax_enable_x64
