"""A campaign from its file to its results: what is missing is flown, whoever flies it."""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from undertow.campaign import task as tasks
from undertow.campaign.columns import METRICS, coordinates, labels
from undertow.campaign.executors import Columns, Work
from undertow.campaign.fingerprint import identity
from undertow.campaign.layout import layout
from undertow.campaign.prepare import Prepared
from undertow.campaign.store import Store

STORE = "trials.zarr"

Executor = Callable[[Callable[..., Columns], Sequence[Work]], Iterator[tuple[int, Columns]]]


class Tally(NamedTuple):
    """How far a campaign is; what was done before it was gone on with counts as done only."""

    trials: int
    done: int
    failed: int
    refused: int

    def after(self, status: np.ndarray) -> "Tally":
        """Once a task more is done."""
        refused = int(np.count_nonzero(status == tasks.REFUSED))
        failed = int(np.count_nonzero(status)) - refused
        return Tally(self.trials, self.done + len(status), self.failed + failed, self.refused + refused)


Watch = Callable[[Tally], None]


def run_campaign(prepared: Prepared, out: Path, executor: Executor, watch: Watch) -> None:
    """Fly what is missing; what is done stays done.

    Args:
        prepared: the campaign.
        out: folder of the store.
        executor: flies tasks.
        watch: told after each task.

    Raises:
        BadInput: the folder holds another campaign.
        OSError: the disk is full, or the cluster is gone; what was done is kept.
    """
    several, text, folder = prepared.trials, prepared.text, prepared.folder
    store = Store(
        out / STORE,
        layout(several.campaign),
        identity(text, prepared.named),
        labels(several, prepared.first, prepared.metrics),
        coordinates(several, prepared.first),
        {METRICS: json.dumps({name: list(metric) for name, metric in prepared.metrics.items()})},
    )
    try:
        missing = store.missing()
        tally = Tally(several.number, several.number - sum(map(store.layout.count, missing)), 0, 0)
        watch(tally)
        work = [(text, str(folder), store.layout, number) for number in missing]
        for i, columns in executor(tasks.run_block, work):
            store.write(missing[i], columns)
            tally = tally.after(columns["status"])
            watch(tally)
    finally:
        store.close()
