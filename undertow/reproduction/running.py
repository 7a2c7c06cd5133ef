"""Running named scenarios in batches of one program: with everything that is recorded, or for metrics alone."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import Gathered, accumulators, results
from undertow.campaign.batch_runner import leaves, planned, run_of
from undertow.campaign.campaign_schema import Series
from undertow.core.runtime import double_outside_runs, on_processor
from undertow.core.status import Status
from undertow.loop import continuous
from undertow.loop.outcome import Outcome
from undertow.loop.simd_batch import BatchRunner, Plan, Run, Unsupported, outcome_of, simd_width
from undertow.reproduction.all_outputs import with_all_outputs
from undertow.scenario.build import Built, build
from undertow.scenario.execute import Executed, execute, finished, gathered_of, save
from undertow.scenario.part_cache import PartCache, structure
from undertow.scenario.reading import dump

Scenarios = Mapping[str, dict[str, Any]]
Window = tuple[float, float]  # s
_Runs = dict[str, tuple[Run, int]]  # by name, with their numbers of steps
Progress = Callable[[str, float], None]


@contextmanager
def two_at_once() -> Iterator[Executor]:
    """Two threads, which use two cores: compiling and running release Python's lock most of the time.

    An error cancels what has not begun.
    """
    with ThreadPoolExecutor(2) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def run_all(
    scenarios: Scenarios, folder: Path, progress: Progress = lambda message, share: None
) -> dict[str, Executed]:
    """Run named scenarios with everything that is recorded of them, those of equal programs in one batch.

    Writes `scenarios/<name>.yaml` and `runs/<name>.nc`.

    Args:
        scenarios: name -> scenario.
        folder: folder of the results.
        progress: called with a message and the share done.
    """
    write_all(scenarios, folder)
    (folder / "runs").mkdir(exist_ok=True)
    built, found = _built(scenarios), {}
    alone = {name: one for name, one in built.items() if one.scenario.loop.method == "adaptive"}
    groups = _groups({name: one for name, one in built.items() if name not in alone}, _whole)
    with two_at_once() as pool:
        # What XLA compiles takes longest; it is begun first.
        tasks = [pool.submit(lambda name=name, one=one: {name: execute(one)}) for name, one in alone.items()]
        tasks += [pool.submit(_executed, plan, runs, built) for plan, runs in groups]
        for task in as_completed(tasks):
            for name, one in task.result().items():
                found[name] = one
                save(one.dataset, folder / "runs" / f"{name}.nc")
                progress(f"ran {name}", len(found) / len(scenarios))
    return {name: found[name] for name in scenarios}


def write_all(scenarios: Scenarios, folder: Path) -> None:
    """Write `scenarios/<name>.yaml`, so that each can be run again."""
    (folder / "scenarios").mkdir(parents=True, exist_ok=True)
    for name, scenario in scenarios.items():
        (folder / "scenarios" / f"{name}.yaml").write_text(dump(scenario), encoding="utf-8")


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
    """Run sampled scenarios, those of equal programs in one batch; arguments and errors of `start`."""
    with ThreadPoolExecutor(1) as pool:
        return start(scenarios, windows, every, signals, pool)()


def start(
    scenarios: Scenarios, windows: Sequence[Window], every: float, signals: Sequence[str], pool: Executor
) -> Callable[[], dict[str, BatchResult]]:
    """Start to run sampled scenarios, one task for each program.

    Args:
        scenarios: by name; all of them scenarios of the sampled loop.
        windows: windows of the metrics, s.
        every: time between records, s.
        signals: recorded signals.
        pool: executor of the tasks.

    Returns:
        Function that waits for the results; it raises Unsupported where the batch compiler lacks an operation.
    """
    built = _built(scenarios)
    asked = Series(signals=list(signals), every=every)
    run = lambda one: run_of(one)._replace(accumulators=_gathered(one, windows))
    pieces = [
        pool.submit(_together, plan, runs) for plan, runs in _groups(built, lambda one: (run(one), planned(one, asked)))
    ]

    def finished() -> dict[str, BatchResult]:
        ended = {name: one for piece in pieces for name, one in piece.result().items()}
        return {name: _ran(one, ended[name], windows) for name, one in built.items()}

    return finished


def _gathered(built: Built, windows: Sequence[Window]) -> Gathered:
    return tuple(one for window in windows for one in accumulators(built.closed_loop.plant, (), *window))


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


def _executed(plan: Plan, runs: _Runs, built: Mapping[str, Built]) -> dict[str, Executed]:
    """Runs of one program as `execute` returns them; one by one where the batch compiler lacks an operation."""
    with on_processor():
        try:
            ended = _together(plan, runs)
        except Unsupported:
            return {name: execute(built[name]) for name in runs}
        found = {}
        for name, (run, _) in runs.items():
            outcome = ended[name]
            if plan.continuous:
                outcome = continuous.explained(run.loop, run.key, outcome, plan.dt)
            found[name] = finished(built[name], jax.device_get(outcome), {}, run.accumulators)
        return found


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
    batch = BatchRunner(first, plan, constant, width)
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
