"""Run the missing tasks of a campaign with an executor and write their results to the store."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from undertow.simulation.executors import Executor
from undertow.studies.campaign import task as tasks
from undertow.studies.campaign.columns import METRICS, coordinates, labels
from undertow.studies.campaign.fingerprint import identity
from undertow.studies.campaign.prepare import Prepared
from undertow.studies.campaign.store import Store
from undertow.studies.campaign.store_layout import TASKS, layout

STORE = "trials.zarr"


class Tally(NamedTuple):
    """Progress of a campaign. `failed` and `invalid` do not count trials done before it was resumed."""

    trials: int
    done: int
    failed: int
    invalid: int

    def after(self, status: np.ndarray) -> "Tally":
        """Progress after one more task."""
        invalid = int(np.count_nonzero(status == tasks.INVALID))
        failed = int(np.count_nonzero(status)) - invalid
        return Tally(self.trials, self.done + len(status), self.failed + failed, self.invalid + invalid)


Watch = Callable[[Tally], None]  # called after each task

# Tasks of a thread, so that no thread waits long for the last one; and steps of all trials of a task: some seconds of a
# vehicle, after which progress is seen. What is done once per task, a tenth of a second, is little beside that.
_OF_A_THREAD, _STEPS = 8, 3_000_000


def run_campaign(prepared: Prepared, out: Path, executor: Executor, watch: Watch, threads: int | None = None) -> None:
    """Run the missing tasks of a campaign, with its store in the folder `out`.

    Args:
        prepared: the campaign.
        out: folder of the results.
        executor: runs the tasks.
        watch: is called after each.
        threads: by which it runs them; None for a cluster.

    Raises:
        BadInput: the folder holds another campaign.
        OSError: the disk is full, or the cluster is lost; finished tasks are kept.
    """
    campaign_trials, text, folder = prepared.trials, prepared.text, prepared.folder
    store = Store(
        out / STORE,
        layout(campaign_trials.campaign, _number_of_tasks(prepared, threads)),
        identity(text, prepared.named),
        labels(campaign_trials, prepared.first, prepared.metrics),
        coordinates(campaign_trials, prepared.first),
        {METRICS: json.dumps({name: list(metric) for name, metric in prepared.metrics.items()})},
    )
    try:
        missing = store.missing()
        tally = Tally(campaign_trials.number, campaign_trials.number - sum(map(store.layout.count, missing)), 0, 0)
        watch(tally)
        work = [(text, str(folder), store.layout, number) for number in missing]
        for i, columns in executor(tasks.run_block, work):
            store.write(missing[i], columns)
            tally = tally.after(columns["status"])
            watch(tally)
    finally:
        store.close()


def _number_of_tasks(prepared: Prepared, threads: int | None) -> int:
    """About how many tasks; arguments of `run_campaign`."""
    if threads is None:
        return TASKS
    loop = prepared.first.scenario.loop
    steps = prepared.trials.number * loop.duration / loop.dt
    return max(_OF_A_THREAD * threads, math.ceil(steps / _STEPS))
