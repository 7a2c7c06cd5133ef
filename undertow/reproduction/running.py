"""Running named scenarios in batches of one program: with everything that is recorded, or for metrics alone."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import Gathered, accumulators, results
from undertow.campaign.batch_runner import leaves, planned, run_of
from undertow.campaign.campaign_schema import Series
from undertow.core.disk import write_whole
from undertow.core.runtime import double_outside_runs, on_processor
from undertow.core.status import Status
from undertow.loop import continuous
from undertow.loop.outcome import Outcome
from undertow.loop.simd_batch import BatchRunner, Plan, Run, Unsupported, outcome_of, simd_width
from undertow.reproduction.all_outputs import with_all_outputs
from undertow.reproduction.side_by_side import Tasks, side_by_side
from undertow.scenario.build import Built, build
from undertow.scenario.part_cache import PartCache, structure
from undertow.scenario.reading import dump
from undertow.simulation.repetition import shortened
from undertow.simulation.result_files import save
from undertow.simulation.run_result import ScenarioResult
from undertow.simulation.run_scenario import finished, gathered_of, run_scenario

Scenarios = Mapping[str, dict[str, Any]]
Window = tuple[float, float]  # s
# What `runs/` keeps of a run: the series of the paper's figures. Repeated from its file, the others come back.
_KEPT = ("position", "reference", "input", "uncertainty", "estimate")
_Runs = dict[str, tuple[Run, int]]  # by name, with their numbers of steps


def begin_all(scenarios: Scenarios, folder: Path, tasks: Tasks) -> Callable[[], dict[str, ScenarioResult]]:
    """Begin to run named scenarios with everything that is recorded of them, those of equal programs in one batch.

    Writes `scenarios/<name>.yaml` and `runs/<name>.nc`.

    Args:
        scenarios: name -> scenario.
        folder: folder of the results.
        tasks: where the runs are tasks.

    Returns:
        Function that waits for the results.
    """
    write_all(scenarios, folder)
    (folder / "runs").mkdir(exist_ok=True)
    # The adaptive integrator takes longest to compile, once for all of them: it begins before others are built.
    alone = {name: one for name, one in scenarios.items() if one["loop"].get("method") == "adaptive"}
    pieces = [tasks.begin(f"ran {_words(alone)}", _one_by_one, _built(alone), folder)] if alone else []
    built = _built({name: one for name, one in scenarios.items() if name not in alone})
    groups = _groups(built, _whole)
    for plan, runs in groups:
        own = {name: built[name] for name in runs}
        pieces.append(tasks.begin(f"ran {_words(runs)}", _executed, plan, runs, own, folder))

    def finished() -> dict[str, ScenarioResult]:
        found = {name: one for piece in pieces for name, one in piece.result().items()}
        return {name: found[name] for name in scenarios}

    return finished


def write_all(scenarios: Scenarios, folder: Path) -> None:
    """Write `scenarios/<name>.yaml`, so that each can be run again."""
    (folder / "scenarios").mkdir(parents=True, exist_ok=True)
    for name, scenario in scenarios.items():
        write_whole(folder / "scenarios" / f"{name}.yaml", dump(scenario))


class BatchResult(NamedTuple):
    """One run of a batch."""

    built: Built
    status: Status
    ended: float  # s
    windows: list[dict[str, Any] | None]  # metrics over each window; None where the run ended earlier
    series: dict[str, np.ndarray]  # (records, ...), up to the end of the run
    time: np.ndarray  # of the records, s

    @property
    def lasted(self) -> bool:
        """Whether it reached its end."""
        return self.status is Status.OK


def run_batches(
    scenarios: Scenarios, windows: Sequence[Window], every: float, signals: Sequence[str]
) -> dict[str, BatchResult]:
    """Run sampled scenarios, those of equal programs in one batch; arguments and errors of `begin_batches`."""
    with side_by_side(1) as pool:
        return begin_batches(scenarios, windows, every, signals, Tasks(pool, lambda words, share: None))()


def begin_batches(
    scenarios: Scenarios, windows: Sequence[Window], every: float, signals: Sequence[str], tasks: Tasks
) -> Callable[[], dict[str, BatchResult]]:
    """Begin to run sampled scenarios, one task for each program.

    Args:
        scenarios: by name; all of them scenarios of the sampled loop.
        windows: windows of the metrics, s.
        every: time between records, s.
        signals: recorded signals.
        tasks: where the batches are tasks.

    Returns:
        Function that waits for the results; it raises Unsupported where the batch compiler lacks an operation.
    """
    built = _built(scenarios)
    asked = Series(signals=list(signals), every=every)
    run = lambda one: run_of(one)._replace(accumulators=_gathered(one, windows))
    groups = _groups(built, lambda one: (run(one), planned(one, asked)))
    pieces = [tasks.begin(f"ran {_words(runs)}", _together, plan, runs) for plan, runs in groups]

    def finished() -> dict[str, BatchResult]:
        ended = {name: one for piece in pieces for name, one in piece.result().items()}
        return {name: _ran(one, ended[name], windows) for name, one in built.items()}

    return finished


def _gathered(built: Built, windows: Sequence[Window]) -> Gathered:
    return tuple(one for window in windows for one in accumulators(built.closed_loop.plant, (), *window))


def _words(runs: Mapping[str, Any]) -> str:
    """Names of the runs of a batch, in short."""
    return next(iter(runs)) + (f" and {len(runs) - 1} like it" if len(runs) > 1 else "")


def _built(scenarios: Scenarios) -> dict[str, Built]:
    part_cache = PartCache()
    return {name: build(scenario, part_cache=part_cache) for name, scenario in scenarios.items()}


def _groups(built: Mapping[str, Built], how: Callable[[Built], tuple[Run, Plan]]) -> list[tuple[Plan, _Runs]]:
    """Runs of equal programs, with their plan; they may differ in the number of steps."""
    groups: dict[Any, _Runs] = {}
    for name, one in built.items():
        run, plan = how(one)
        groups.setdefault((structure(run), plan._replace(steps=0)), {})[name] = (run, plan.steps)
    return [(plan, runs) for (_, plan), runs in groups.items()]


def _whole(built: Built) -> tuple[Run, Plan]:
    """A run as `execute` does it: everything is recorded."""
    run, loop = run_of(built)._replace(accumulators=gathered_of(built)), built.scenario.loop
    signals = tuple(built.closed_loop.signals())
    if loop.kind == "continuous":
        steps, every, dt = continuous.grid_of(loop.duration, loop.record, loop.dt)
        return run, Plan(steps, dt, every, signals, continuous=True)
    return run, planned(built, Series(signals=list(signals), every=loop.record))


def _one_by_one(built: Mapping[str, Built], folder: Path) -> dict[str, ScenarioResult]:
    """Runs, written to `runs/`."""
    return {name: _saved(name, run_scenario(one), folder) for name, one in built.items()}


def _executed(plan: Plan, runs: _Runs, built: Mapping[str, Built], folder: Path) -> dict[str, ScenarioResult]:
    """Runs of one program, written to `runs/`; one by one where the batch compiler lacks an operation."""
    with on_processor():
        try:
            ended = _together(plan, runs)
        except Unsupported:
            return _one_by_one(built, folder)
        found = {}
        for name, (run, _) in runs.items():
            outcome = ended[name]
            if plan.continuous:
                outcome = jax.device_get(continuous.explained(run.loop, run.key, outcome, plan.dt))
            found[name] = _saved(name, finished(built[name], outcome, "", run.accumulators), folder)
        return found


def _saved(name: str, one: ScenarioResult, folder: Path) -> ScenarioResult:
    save(shortened(one.dataset, _KEPT), folder / "runs" / f"{name}.nc")
    return one


@double_outside_runs
def _together(plan: Plan, runs: _Runs) -> dict[str, Outcome]:
    """Runs of one program, by name with their numbers of steps; those of one length in one batch."""
    first = next(iter(runs.values()))[0]
    numbers = {name: leaves(run) for name, (run, _) in runs.items()}
    constant = [
        all(np.array_equal(column[0], other) for other in column[1:]) for column in zip(*numbers.values(), strict=True)
    ]
    lengths = {steps: [name for name in runs if runs[name][1] == steps] for _, steps in runs.values()}
    # For one run a program of width one is faster than one of width eight.
    width = min(simd_width(64), 1 << (max(map(len, lengths.values())) - 1).bit_length())
    batch = BatchRunner(first, plan._replace(steps=max(lengths)), constant, width, runs=len(runs))
    tree, found = jax.tree.structure(eqx.filter(first, eqx.is_array)), {}
    for steps, names in lengths.items():
        stacked = [np.stack(column) for column in zip(*(numbers[name] for name in names), strict=True)]
        outcome = batch.run(jax.tree.unflatten(tree, stacked), steps)
        for i, name in enumerate(names):
            found[name] = outcome_of(outcome, i)
    return found


def _ran(built: Built, outcome: Outcome, windows: Sequence[Window]) -> BatchResult:
    status, end = Status(int(outcome.status)), float(outcome.ended)
    each = zip(_gathered(built, windows), outcome.accumulated, windows, strict=True)
    metrics = [with_all_outputs(results((one,), (state,))) if end >= stop else None for one, state, (_, stop) in each]
    time = np.asarray(outcome.time)
    kept = time <= end
    series = {name: np.asarray(values)[kept] for name, values in outcome.signals.items()}
    return BatchResult(built, status, end, metrics, series, time[kept])
