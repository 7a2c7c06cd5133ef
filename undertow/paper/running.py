"""Running named scenarios in batches of one program: with everything that is recorded, or for metrics alone."""

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.analysis.metrics import Gathered, accumulators, results
from undertow.core.atomic_io import write_whole
from undertow.core.batch_compiler import Unsupported
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.runtime import on_processor
from undertow.core.status import Status
from undertow.paper.all_outputs import with_all_outputs
from undertow.scenario.build import Built, build
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import prepare
from undertow.scenario.reading import dump
from undertow.scenario.results.netcdf import save
from undertow.scenario.results.repetition import shortened
from undertow.scenario.results.run_result import ScenarioResult
from undertow.scenario.results.run_scenario import finished, gathered_of, run_scenario
from undertow.simulation.loop import continuous
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.prepared_run import PreparedRun
from undertow.simulation.processes import Tasks, worker_processes
from undertow.simulation.programs import ProgramCache, RunGroup
from undertow.simulation.run_many import BatchResult, run_group

Scenarios = Mapping[str, dict[str, Any]]
Window = tuple[float, float]  # s
# What `runs/` keeps of a run: the series of the paper's figures. Repeated from its file, the others come back.
_KEPT = ("position", "reference", "input", "uncertainty", "estimate")


def start_all(scenarios: Scenarios, folder: Path, tasks: Tasks) -> Callable[[], dict[str, ScenarioResult]]:
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
    adaptive = {name: data for name, data in scenarios.items() if data["loop"].get("method") == "adaptive"}
    pieces = [tasks.submit(f"ran {_words(adaptive)}", _one_by_one, _built(adaptive), folder)] if adaptive else []
    built = _built({name: data for name, data in scenarios.items() if name not in adaptive})
    names = list(built)
    for group in ProgramCache().groups(_recorded(built_scenario) for built_scenario in built.values()):
        group_scenarios = {names[index]: built[names[index]] for index in group.places}
        pieces.append(tasks.submit(f"ran {_words(group_scenarios)}", _executed, group, group_scenarios, folder))

    def finished() -> dict[str, ScenarioResult]:
        results = {name: result for piece in pieces for name, result in piece.result().items()}
        return {name: results[name] for name in scenarios}

    return finished


def write_all(scenarios: Scenarios, folder: Path) -> None:
    """Write `scenarios/<name>.yaml`, so that each can be run again."""
    (folder / "scenarios").mkdir(parents=True, exist_ok=True)
    for name, scenario in scenarios.items():
        write_whole(folder / "scenarios" / f"{name}.yaml", dump(scenario))


class BatchedRun(NamedTuple):
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
) -> dict[str, BatchedRun]:
    """Run sampled scenarios, those of equal programs in one batch; arguments and errors of `start_batches`."""
    with worker_processes(1) as pool:
        return start_batches(scenarios, windows, every, signals, Tasks(pool, lambda words, share: None))()


def start_batches(
    scenarios: Scenarios, windows: Sequence[Window], every: float, signals: Sequence[str], tasks: Tasks
) -> Callable[[], dict[str, BatchedRun]]:
    """Begin to run sampled scenarios, one task for each program.

    Args:
        scenarios: by name; all of them scenarios of the sampled loop.
        windows: windows of the metrics, s.
        every: time between records, s.
        signals: recorded signals.
        tasks: where the batches are tasks.

    Returns:
        Function that waits for the results.
    """
    built = _built(scenarios)
    names = list(built)
    runs = [
        prepare(built_scenario, signals, every, _gathered(built_scenario, windows)) for built_scenario in built.values()
    ]
    pieces = []
    for group in ProgramCache().groups(runs):
        words = _words([names[index] for index in group.places])
        pieces.append(tasks.submit(f"ran {words}", run_group, group))

    def finished() -> dict[str, BatchedRun]:
        batches = [batch for piece in pieces for batch in piece.result()]
        outcomes = {names[index]: outcome for batch in batches for index, outcome in batch.each()}
        return {name: _ran(built_scenario, outcomes[name], windows) for name, built_scenario in built.items()}

    return finished


def _gathered(built: Built, windows: Sequence[Window]) -> Gathered:
    return tuple(
        accumulator for window in windows for accumulator in accumulators(built.closed_loop.plant, (), *window)
    )


def _words(runs: Collection[str]) -> str:
    """Names of the runs of a batch, in short."""
    return next(iter(runs)) + (f" and {len(runs) - 1} like it" if len(runs) > 1 else "")


def _built(scenarios: Scenarios) -> dict[str, Built]:
    part_cache = PartCache()
    return {name: build(scenario, part_cache=part_cache) for name, scenario in scenarios.items()}


def _recorded(built: Built) -> PreparedRun:
    """A run as `run_scenario` does it: everything is recorded."""
    return prepare(built, list(built.closed_loop.signals()), built.scenario.loop.record, gathered_of(built))


def _one_by_one(built: Mapping[str, Built], folder: Path) -> dict[str, ScenarioResult]:
    """Runs, written to `runs/`."""
    return {name: _saved(name, run_scenario(built_scenario), folder) for name, built_scenario in built.items()}


def _executed(group: RunGroup, built: Mapping[str, Built], folder: Path) -> dict[str, ScenarioResult]:
    """Runs of one program, written to `runs/`; one by one where the batch compiler lacks an operation."""
    try:
        batches = run_group(group)
    except Unsupported:
        return _one_by_one(built, folder)
    names = {int(index): name for index, name in zip(group.places, built, strict=True)}
    results = {}
    for batch in batches:
        for index, outcome in batch.each():
            built_scenario = built[names[index]]
            results[names[index]] = _saved(names[index], _finished(built_scenario, outcome, batch), folder)
    return results


def _finished(built: Built, outcome: Outcome, batch: BatchResult) -> ScenarioResult:
    with on_processor():
        if batch.first.plan.continuous:
            key, dt = key_of_seed(built.scenario.seed), batch.first.plan.dt
            outcome = jax.device_get(continuous.explained(built.closed_loop, key, outcome, dt))
        return finished(built, outcome, batch.left_to_xla, gathered_of(built))


def _saved(name: str, result: ScenarioResult, folder: Path) -> ScenarioResult:
    save(shortened(result.dataset, _KEPT), folder / "runs" / f"{name}.nc")
    return result


def _ran(built: Built, outcome: Outcome, windows: Sequence[Window]) -> BatchedRun:
    status, end = Status(int(outcome.status)), float(outcome.ended)
    columns = zip(_gathered(built, windows), outcome.accumulated, windows, strict=True)
    metrics = [
        with_all_outputs(results((accumulator,), (state,))) if end >= stop else None
        for accumulator, state, (_, stop) in columns
    ]
    time = np.asarray(outcome.time)
    valid = time <= end
    series = {name: np.asarray(values)[valid] for name, values in outcome.signals.items()}
    return BatchedRun(built, status, end, metrics, series, time[valid])
