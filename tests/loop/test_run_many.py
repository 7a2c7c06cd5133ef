"""Many runs: each has the bits that it has by itself, in the given order, whatever they share and whoever runs beside."""

import jax
import numpy as np
import pytest

from undertow.scenario.build import build
from undertow.scenario.prepare import prepare
from undertow.simulation.loop import batch_runner
from undertow.simulation.loop.loop_runs import numbers_of
from undertow.simulation.loop.simd_batch import Unsupported
from undertow.simulation.prepared_run import PreparedRun, RunBatch
from undertow.simulation.programs import ProgramCache
from undertow.simulation.run_many import in_order, run_many, run_together

SCENARIO = {
    "plant": {"kind": "double_integrator"},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "navigation": {"kind": "white_noise", "position": 0.01, "velocity": 0.01},
    "loop": {"dt": 0.02, "duration": 1.0, "record": 0.02},
}


def prepared(frequency=2.0, seed=0, **changes) -> PreparedRun:
    data = SCENARIO | {"controller": {"kind": "pid", "frequency": frequency}, "seed": seed} | changes
    return prepare(build(data), ("position", "input"), 0.02)


def longer(run: PreparedRun, steps: int) -> PreparedRun:
    return run._replace(plan=run.plan._replace(steps=steps))


def alone(run: PreparedRun):
    (batch,) = run_many([run])
    return next(outcome for _, outcome in batch.each())


def assert_same(outcome, expected):
    jax.tree.map(np.testing.assert_array_equal, outcome, expected)


@pytest.mark.full
def test_mixed_runs_have_the_bits_of_each_alone_and_their_places():
    """Two structures, two lengths, several gains and seeds; in one thread, and in pieces of two in two threads."""
    other = {"plant": {"kind": "double_integrator", "axes": 2}, "reference": {"kind": "setpoint", "position": [1, 2]}}
    runs = [prepared(2.0, 1), prepared(3.0, 2), prepared(2.0, 3, **other), longer(prepared(2.0, 4), 30)]
    expected = [alone(run) for run in runs]
    for options in ({}, {"workers": 2, "at_once": 2}):
        done = []
        batches = list(run_many(runs, watch=done.append, **options))
        assert done[-1] == len(runs) and sorted(p for batch in batches for p in batch.places) == list(range(len(runs)))
        for batch in batches:
            assert batch.backend == "simd" and batch.left_to_xla == ""
            for place, outcome in batch.each():
                assert_same(outcome, expected[place])


@pytest.mark.full
def test_a_number_that_probes_share_and_later_runs_do_not():
    """It is a constant of the program until one run differs; no result changes, and few programs are compiled."""
    probes = [prepared(2.0, seed) for seed in range(3)]
    programs = ProgramCache(lambda: probes)
    like, unlike = [prepared(2.0, 7), prepared(2.0, 8)], [prepared(2.5, 7), prepared(2.0, 8)]
    compiled = []
    for runs in (like, unlike, like):
        (group,) = programs.groups(runs)
        compiled.append(programs.runner(group))
        (batch,) = run_many(runs, programs=programs)
        for place, outcome in batch.each():
            assert_same(outcome, alone(runs[place]))
    assert compiled[0] is not compiled[1] and compiled[1] is compiled[2]


@pytest.mark.full
def test_a_cache_without_probes_takes_no_constant_of_an_earlier_call():
    programs = ProgramCache()
    for gain in (2.0, 3.0, 2.0):
        runs = [prepared(gain, seed) for seed in (1, 2)]
        (batch,) = run_many(runs, programs=programs)
        for place, outcome in batch.each():
            assert_same(outcome, alone(runs[place]))


@pytest.mark.full
def test_runs_given_as_arrays():
    """A batch whose first run is unlike the rest: only the arrays count."""
    runs = [prepared(2.0, seed) for seed in (1, 2, 3)]
    columns = [np.stack(column) for column in zip(*(numbers_of(run.run) for run in runs), strict=True)]
    batch = RunBatch(prepared(5.0, 9), columns, 3)
    for probes in (None, lambda: runs):
        results = list(run_many([runs[0], batch], programs=ProgramCache(probes)))
        found = in_order(results, [result.outcome for result in results])
        for place, run in enumerate((runs[0], *runs)):
            assert_same(jax.tree.map(lambda leaf, place=place: leaf[place], found), alone(run))


@pytest.mark.full
def test_what_the_batch_compiler_lacks_runs_by_xla(monkeypatch):
    runs = [prepared(2.0, 1), prepared(3.0, 2)]
    expected = run_together(runs)

    def lacking(*_, **__):
        raise Unsupported("an operation of this test")

    monkeypatch.setattr(batch_runner, "SimdBatchRunner", lacking)
    (batch,) = run_many(runs)
    assert (batch.backend, batch.left_to_xla) == ("xla", "an operation of this test")
    close = lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12)
    jax.tree.map(close, batch.outcome.signals, expected.signals)
    continuous = runs[0]._replace(plan=runs[0].plan._replace(continuous=True))
    with pytest.raises(Unsupported, match="an operation of this test"):
        list(run_many([continuous]))


def test_no_runs():
    assert list(run_many([])) == []
