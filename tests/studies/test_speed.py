"""Workload W1 is what it is said to be, and `undertow bench` tells it."""

import json

import equinox as eqx
import jax
import numpy as np
import pytest
from lanes.emulated_gpu import EmulatedGpu

from undertow.cli.main import run
from undertow.lanes import nvidia
from undertow.lanes.cuda import Driver
from undertow.loop import sampled
from undertow.loop.in_lanes import Fleet
from undertow.studies.speed import measure, plain_numpy, workload


def test_the_workload_is_that_of_plain_numpy():
    """Mean square of the error over the second half of the first two seconds: two programs that share no code."""
    one = workload.one()
    late = eqx.tree_at(lambda run: (run.accumulators[0].start, run.accumulators[0].stop), one, (0.9995, 1.9995))
    fleet = Fleet(late, workload.PLAN._replace(ticks=2000), workload.constant(late))
    found = workload.tracking(fleet.fly(workload.alone(late)).accumulated)[0]
    assert found == pytest.approx(np.sqrt(plain_numpy.workload_w1(2000)), rel=1e-9)


def test_runs_of_a_batch_start_from_different_places():
    one = workload.one()
    fleet = Fleet(one, workload.PLAN._replace(ticks=11_000), workload.constant(one))
    rms = workload.tracking(fleet.fly(workload.several(one, 9)).accumulated)
    assert len(set(rms)) == 9
    places = workload.several(one, 9).start
    at = {"position": places[0][4], "velocity": places[1][4]}
    wanted = sampled.simulate(one.loop, duration=11.0, record_every=0, accumulators=one.accumulators, **at)
    assert rms[4] == pytest.approx(workload.tracking(wanted.accumulated), rel=1e-9)


def test_what_a_gpu_would_do(monkeypatch):
    """What is measured on a GPU: by `jax.vmap`, a narrow program here, and by threads, for which this processor stands in."""
    one = workload.one()
    assert measure.vmapped_ns(one, runs=3, ticks=5) > 0
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, generation: assembly)
    found = measure.on_gpu(one, Driver(EmulatedGpu()), runs=40, ticks=5)
    assert found["ns"] > 0 and found["ticks_per_second"] == pytest.approx(1e9 / found["ns"])


@pytest.mark.slow
def test_bench(capsys):
    assert run(["bench", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["tracking_rms"] == pytest.approx(0.004312, abs=1e-6)
    assert found["single_times_numpy"] == pytest.approx(found["numpy_ns"] / found["single_ns"], rel=1e-4)
    assert found["first_cold_s"] > found["first_kept_s"] > 0
    assert found["batch_float64_ns"] < found["single_ns"] < found["numpy_ns"]
    assert run(["bench"]) == 0
    assert "plain NumPy" in capsys.readouterr().out
    assert jax.config.jax_enable_x64
