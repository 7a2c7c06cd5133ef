"""Lanes: the same figures as one run at a time, whoever flies beside; failures stay where they are."""

import jax
import numpy as np
import pytest
from emulated_gpu import EmulatedGpu

from simdjit import Driver, nvidia
from undertow.analysis.metrics import Metrics, results
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop import simd_batch, vmap_batch
from undertow.simulation.loop.sampled import simulate
from undertow.simulation.programs import ProgramCache
from undertow.studies.campaign.campaign_schema import validate, whole
from undertow.studies.campaign.task import INVALID, run_trials, task_context
from undertow.studies.campaign.trials import Trials, trials


def made(data) -> Trials:
    text = from_data(data)
    return trials(validate(text), text)


def text_of(data) -> str:
    several = made(data)
    return whole(several.campaign, several.scenario.data)


def columns(data, rows):
    return run_trials(text_of(data), "", rows)


@pytest.mark.full
@pytest.mark.parametrize("backend", ["simd", "xla"], indirect=True)
def test_rows_are_runs(campaign, backend):
    found = columns(campaign(), range(3))
    for trial in range(3):
        built = build(made(campaign()).data(trial))
        key = jax.random.PRNGKey(built.scenario.seed)
        run = simulate(built.closed_loop, duration=2.0, dt=0.02, key=key, accumulators=(Metrics(1.0, 2.0),))
        for name, expected in results((Metrics(1.0, 2.0),), run.accumulated).items():
            if name in found:
                assert found[name][trial] == pytest.approx(expected, rel=1e-9, abs=1e-12), name
        assert found["vary:disturbance.amplitude"][trial] == float(built.closed_loop.disturbance.amplitude)


@pytest.mark.parametrize("runs", [1, 4, 9])
def test_pieces_of_a_batch_are_in_order(runs):
    """Four at once; the last piece is filled up, and what fills it is left out."""
    program = vmap_batch._batched(lambda x: {"double": 2 * x, "sum": x.sum()}, np.zeros(3), 4)
    x = np.arange(3.0 * runs).reshape(runs, 3)
    found = program(x)
    np.testing.assert_array_equal(found["double"], 2 * x)
    np.testing.assert_array_equal(found["sum"], x.sum(1))


@pytest.mark.full
def test_no_bit_depends_on_how_trials_are_cut_into_tasks(campaign, backend):
    """Tasks of 1, 7 and 20 trials, backwards; fewer and more than there are lanes."""
    two = campaign(cross={"controller": [{"kind": "pid", "frequency": 2.0}, {"kind": "rcaf", "preset": "robust"}]})
    at_once = columns(two, range(40))
    for size in (1, 7, 20):
        tasks = [range(i, min(i + size, 40)) for i in range(0, 40, size)]
        pieces = [columns(two, rows) for rows in reversed(tasks)][::-1]
        for name, expected in at_once.items():
            np.testing.assert_array_equal(np.concatenate([piece[name] for piece in pieces]), expected, err_msg=name)


@pytest.mark.slow
def test_a_gpu_changes_no_bit(campaign, monkeypatch):
    """Trials of two laws in tasks of 50, by a GPU that this processor stands in for."""
    two = campaign(cross={"controller": [{"kind": "pid", "frequency": 2.0}, {"kind": "rcaf", "preset": "robust"}]})
    tasks = [range(0, 50), range(50, 80)]
    found = [columns(two, rows) for rows in tasks]
    emulated = EmulatedGpu()
    monkeypatch.setattr(nvidia, "ptx", lambda assembly, *rest: assembly)
    monkeypatch.setattr(simd_batch, "gpu", lambda: Driver(emulated))
    task_context.cache_clear()
    for rows, expected in zip(tasks, found, strict=True):
        jax.tree.map(np.testing.assert_array_equal, columns(two, rows), expected)
    task_context.cache_clear()
    assert len(emulated.launches) == 4 and not emulated.buffers


@pytest.mark.full
def test_numbers_built_into_a_program_change_no_bit(campaign, monkeypatch):
    """The same trials with everything that probes share built in, and with nothing built in."""
    found = columns(campaign(), range(9))
    monkeypatch.setattr(ProgramCache, "_shared_by_probes", lambda self: {})
    task_context.cache_clear()
    general = columns(campaign(), range(9))
    task_context.cache_clear()
    for name, expected in found.items():
        np.testing.assert_array_equal(general[name], expected, err_msg=name)


@pytest.mark.full
def test_a_trial_unlike_all_probes(campaign):
    """A choice that no probe drew is flown all the same, and like the run itself."""
    rare = campaign(vary={"plant.limit": {"choice": [20.0] * 19 + [0.1]}}, design="random")
    limits = [made(rare).values(trial)["plant.limit"] for trial in range(40)]
    odd = limits.index(0.1)
    assert odd >= 4  # the first four are the probes
    found = columns(rare, range(odd, odd + 1))
    built = build(made(rare).data(odd))
    key = jax.random.PRNGKey(built.scenario.seed)
    run = simulate(built.closed_loop, duration=2.0, dt=0.02, key=key, accumulators=(Metrics(1.0, 2.0),))
    assert found["position_rms"][0] == pytest.approx(
        results((Metrics(1.0, 2.0),), run.accumulated)["position_rms"], rel=1e-9
    )


@pytest.mark.full
def test_a_run_that_fails_costs_no_other(campaign, backend):
    """Gains that are far too fast for the sampling time diverge; their neighbours do not notice."""
    unlimited = lambda *frequencies: campaign(
        cross={"plant": [{"kind": "double_integrator", "limit": 1e30}], "controller.frequency": list(frequencies)},
        trials=4,
    )
    tame, wild = unlimited(2.0, 3.0), unlimited(2.0, 500.0)
    good, bad = columns(tame, range(8)), columns(wild, range(8))
    assert (bad["status"][1::2] > 0).all() and np.isnan(bad["position_rms"][1::2]).all()
    assert (bad["ended"][1::2] < 2.0).all()
    np.testing.assert_array_equal(bad["position_rms"][::2], good["position_rms"][::2])


@pytest.mark.full
def test_a_trial_that_cannot_be_built_is_a_row(campaign):
    found = columns(campaign(cross={"controller.frequency": [2.0, -1.0]}, trials=2), range(4))
    assert found["status"].tolist() == [0, INVALID, 0, INVALID]
    assert np.isnan(found["position_rms"]).tolist() == [False, True, False, True]


@pytest.mark.full
def test_a_task_in_which_no_trial_can_be_built(campaign):
    found = columns(campaign(cross={"controller.frequency": [2.0, -1.0]}, trials=2), [1, 3])
    assert found["status"].tolist() == [INVALID, INVALID]
    assert np.isnan(found["position_rms"]).all() and np.isnan(found["ended"]).all()


@pytest.mark.full
def test_series_are_those_of_the_runs(campaign):
    found = columns(campaign(series={"signals": ["position"], "every": 0.5}), range(2))
    built = build(made(campaign()).data(1))
    key = jax.random.PRNGKey(built.scenario.seed)
    run = simulate(built.closed_loop, duration=2.0, dt=0.02, key=key, record_every=25)
    np.testing.assert_allclose(found["series:position"][1], run.signals["position"], rtol=1e-9, atol=1e-12)


@pytest.mark.full
def test_single_precision(campaign):
    """Without noise, which is drawn differently."""
    scenario = campaign()["scenario"] | {"navigation": "perfect"}
    single = text_of(campaign(scenario=scenario | {"precision": "float32"}))
    found = run_trials(single, "", range(9))
    wanted = columns(campaign(scenario=scenario), range(9))
    assert found["position_rms"].dtype == np.float32 and wanted["position_rms"].dtype == np.float64
    np.testing.assert_allclose(found["position_rms"], wanted["position_rms"], rtol=1e-4)
