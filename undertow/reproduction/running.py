"""Running named scenarios: one by one, each saved for repetition, or in batches of one program."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import Gathered, accumulators, results
from undertow.campaign.batch_runner import leaves, planned, run_of
from undertow.campaign.campaign_schema import Series
from undertow.core.runtime import double_outside_runs
from undertow.core.status import Status
from undertow.loop.outcome import Outcome
from undertow.loop.simd_batch import BatchRunner, Plan, Run, simd_width
from undertow.reproduction.all_outputs import with_all_outputs
from undertow.scenario.build import Built, build
from undertow.scenario.execute import Executed, execute, save
from undertow.scenario.part_cache import PartCache, structure
from undertow.scenario.reading import dump

Scenarios = Mapping[str, dict[str, Any]]
Window = tuple[float, float]  # s
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


def run_all(scenarios: Scenarios, folder: Path, progress: Progress) -> dict[str, Executed]:
    """Run named scenarios; writes `scenarios/<name>.yaml` and `runs/<name>.nc`.

    Args:
        scenarios: name -> scenario.
        folder: folder of the results.
        progress: called with a message and the share done.
    """
    write_all(scenarios, folder)
    (folder / "runs").mkdir(exist_ok=True)
    found = {}
    for name, scenario in scenarios.items():
        progress(f"running {name}", len(found) / len(scenarios))
        found[name] = execute(scenario)
        save(found[name].dataset, folder / "runs" / f"{name}.nc")
    return found


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
    part_cache = PartCache()
    built = {name: build(scenario, part_cache=part_cache) for name, scenario in scenarios.items()}
    groups: dict[Any, dict[str, tuple[Run, int]]] = {}
    for name, one in built.items():
        run = run_of(one)._replace(accumulators=_gathered(one, windows))
        plan = planned(one, Series(signals=list(signals), every=every))
        groups.setdefault((structure(run), plan._replace(steps=0)), {})[name] = (run, plan.steps)
    pieces = [pool.submit(_together, plan, runs) for (_, plan), runs in groups.items()]

    def finished() -> dict[str, BatchResult]:
        ended = {name: one for piece in pieces for name, one in piece.result().items()}
        return {name: _ran(one, ended[name], windows) for name, one in built.items()}

    return finished


def _gathered(built: Built, windows: Sequence[Window]) -> Gathered:
    return tuple(one for window in windows for one in accumulators(built.closed_loop.plant, (), *window))


@double_outside_runs
def _together(plan: Plan, runs: Mapping[str, tuple[Run, int]]) -> dict[str, Outcome]:
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
            found[name] = jax.tree.map(lambda leaf, i=i: leaf[i] if isinstance(leaf, np.ndarray) else leaf, outcome)
    return found


def _ran(built: Built, outcome: Outcome, windows: Sequence[Window]) -> BatchResult:
    status, end = Status(int(outcome.status)), float(outcome.ended)
    each = zip(_gathered(built, windows), outcome.accumulated, windows, strict=True)
    metrics = [with_all_outputs(results((one,), (state,))) if end >= stop else None for one, state, (_, stop) in each]
    time = np.asarray(outcome.time)
    kept = time <= end
    series = {name: np.asarray(values)[kept] for name, values in outcome.signals.items()}
    return BatchResult(built, status, end, metrics, series, time[kept])
