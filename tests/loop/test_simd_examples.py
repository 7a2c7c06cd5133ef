"""Closed loops in lanes are those of `sampled.simulate`, and no bit depends on who flies beside."""

import functools
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
import pytest
from recorded import is_as_recorded

from undertow.analysis.metrics import Metrics
from undertow.scenario.build import build
from undertow.scenario.reading import read
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.studies.speed.workload import constant

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ("inverted_pendulum",)
SLOW = (
    "recorded_disturbance",
    "bluerov2_heavy",
    "own_vehicle",
    "large_scale",
    "magnetic_levitation",
    "non_affine",
    "observer_based",
    "two_link_arm",
    "under_actuated",
    "voltage_limited",
    "w1",
)


def example(name, duration=1.0):
    """Everything that both ways to fly it take."""
    built = build(read(EXAMPLES / f"{name}.yaml"))
    scenario, loop = built.scenario, built.scenario.loop
    return built.closed_loop, {
        "duration": duration,
        "dt": loop.dt,
        "key": jax.random.PRNGKey(scenario.seed),
        "position": scenario.initial.position and np.array(scenario.initial.position),
        "velocity": scenario.initial.velocity and np.array(scenario.initial.velocity),
        "record_every": 10,
        "accumulators": (Metrics(0.0, duration),),
        "method": loop.method,
        "substeps": loop.substeps,
    }


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_examples_fly_as_they_do_by_xla(name):
    """Every signal, within 1e-10 of its largest; from noisy sensors 1e-8, as JAX rounds normal numbers earlier."""
    loop, how = example(name)
    found, wanted = simd_batch.simulate(loop, **how), sampled.simulate(loop, **how)
    close = 1e-8 if name in ("bluerov2_heavy", "observer_based") else 1e-10
    assert found.signals.keys() == wanted.signals.keys()
    for signal, there in wanted.signals.items():
        if there.size and signal not in loop.plant.signals():
            scale = np.abs(there).max()
            np.testing.assert_allclose(
                found.signals[signal], there, rtol=0, atol=close * max(scale, 1e-9), err_msg=signal
            )
    values = lambda run: how["accumulators"][0].values(run.accumulated[0])
    for key, here in values(found).items():
        np.testing.assert_allclose(here, values(wanted)[key], rtol=1e-7, atol=1e-12, err_msg=key)
    if name in QUICK:
        is_as_recorded(f"loop: {name}", [wanted.signals[signal] for signal in sorted(wanted.signals)])
    assert found.status == wanted.status == 0 and found.ended == float(wanted.ended)


@functools.cache
def at_70_steps(simulate, every):
    """The pendulum for 70 steps."""
    loop, how = example("inverted_pendulum", 0.07)
    return simulate(loop, **(how | {"dt": 0.001, "record_every": every}))


@pytest.mark.slow
@pytest.mark.parametrize("every", [35, *(pytest.param(every, marks=pytest.mark.slow) for every in (0, 10, 70))])
def test_a_run_lasts_as_long_however_seldom_it_is_recorded(every):
    """70 steps, recorded every 32, and at divisors of 70 or never: the same end and statistics by lanes and by XLA."""
    for simulate in (simd_batch.simulate, sampled.simulate):
        found, wanted = at_70_steps(simulate, 32), at_70_steps(simulate, every)
        np.testing.assert_allclose(found.time, [0.0, 0.032, 0.064], rtol=1e-12)
        assert found.ended == wanted.ended == pytest.approx(0.07)
        close = lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15)
        jax.tree.map(close, (found.accumulated, found.final), (wanted.accumulated, wanted.final))


@pytest.mark.full
def test_no_bit_depends_on_neighbours_width_or_what_is_built_in():
    """Eleven runs from different places: in one batch, backwards, one by one, and with nothing built in."""
    loop, how = example("inverted_pendulum")
    start = loop.outputs_at_start(None, None)
    run = LoopRun(loop, how["accumulators"], start, how["key"])
    plan = RunPlan(500, how["dt"], 50, ("position", "input"), how["method"], how["substeps"])
    numbers = eqx.filter(run, eqx.is_array)
    leaves = jax.tree.leaves(numbers)
    many = jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (11, *leaf.shape)), numbers)
    places = np.random.default_rng(0).normal(scale=0.05, size=(11, *start[0].shape))
    many = many._replace(start=(places, many.start[1]))
    same = constant(run)
    batch = simd_batch.SimdBatchRunner(run, plan, same)
    found = batch.run(many)
    backwards = batch.run(jax.tree.map(lambda leaf: leaf[::-1], many))
    general = simd_batch.SimdBatchRunner(run, plan, [False] * len(leaves)).run(many)
    alone = simd_batch.SimdBatchRunner(run, plan, same, width=1)
    for i in range(11):
        single = alone.run(jax.tree.map(lambda leaf, i=i: leaf[i : i + 1], many))
        same = lambda a, b, i=i: np.testing.assert_array_equal(a[0], b[i])
        jax.tree.map(same, (single.accumulated, single.signals), (found.accumulated, found.signals))
    pair = lambda one: (one.accumulated, one.signals)
    jax.tree.map(lambda a, b: np.testing.assert_array_equal(a[::-1], b), pair(backwards), pair(found))
    jax.tree.map(np.testing.assert_array_equal, pair(general), pair(found))


@pytest.mark.full
def test_a_run_that_diverges_ends_where_it_does_by_xla():
    """Its last sound state is kept, and its end is told."""
    loop, how = example("inverted_pendulum", 3.0)

    how |= {"position": np.full(len(loop.plant.outputs), 3.0)}
    found, wanted = simd_batch.simulate(loop, **how), sampled.simulate(loop, **how)
    assert found.status == int(wanted.status) != 0 and found.ended == float(wanted.ended)
    np.testing.assert_allclose(found.signals["position"][-1], wanted.signals["position"][-1], rtol=1e-6)
