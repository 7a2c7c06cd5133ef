"""A campaign from its file to its results: what is missing is flown, whoever flies it."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.analysis.metrics import OVERALL
from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean
from undertow.loop.closed_loop import Sample
from undertow.scenario.fitting import whole_steps
from undertow.scenario.provenance import text_hash, versions
from undertow.scenario.schema import Loop
from undertow.studies.campaign import task as tasks
from undertow.studies.campaign.engines import Columns, Work
from undertow.studies.campaign.reading import read_campaign, whole
from undertow.studies.campaign.schema import Campaign
from undertow.studies.campaign.store import Store
from undertow.studies.campaign.trials import Trials, trials

STORE = "trials.zarr"

Engine = Callable[[Callable[..., Columns], Sequence[Work]], Iterator[tuple[int, Columns]]]
Watch = Callable[[int, int, int], None]  # trials done, all of them, and how many of those done failed


class Prepared(NamedTuple):
    """A campaign that could be flown."""

    trials: Trials
    text: str
    folder: Path


def prepare(path: Path) -> Prepared:
    """Read a campaign, and build the first trial of every combination, so that mistakes are told before anything runs.

    Raises:
        BadInput: anything wrong with the campaign or its scenario.
    """
    campaign, folder = read_campaign(path)
    several = trials(campaign, folder)
    text = whole(campaign, several.scenario.data)
    prepared = Prepared(several, text, several.scenario.folder)
    workshop = tasks.site(text, str(prepared.folder)).workshop
    for combination in range(len(several.combinations)):
        _check(campaign, tasks.build_trial(several, workshop, combination * campaign.trials).scenario.loop)
    return prepared


def _check(campaign: Campaign, loop: Loop) -> None:
    """What a campaign asks of its runs."""
    if loop.kind != "sampled":
        raise BadInput("scenario.loop.kind", "be sampled in a campaign", loop.kind)
    for name in campaign.requirements:
        if name not in OVERALL:
            raise BadInput(f"requirements.{name}", "be a metric", "unknown", hint=did_you_mean(name, OVERALL))
    if campaign.series is None:
        return
    for key in (*campaign.vary, *campaign.cross):
        if key.startswith("loop"):
            raise BadInput("series", "be of runs of one length and sampling time", f"beside {key}, which differs")
    for i, name in enumerate(campaign.series.signals):
        checks.choice(f"series.signals[{i}]", name, [field for field in Sample._fields if field != "books"])
    if not whole_steps(campaign.series.every, loop.dt):
        must = f"be a whole number of sampling times ({loop.dt:g} s)"
        raise BadInput("series.every", must, f"{campaign.series.every:g} s")
    if campaign.series.every > loop.duration:
        raise BadInput("series.every", f"be at most the duration ({loop.duration:g} s)", f"{campaign.series.every:g} s")


def conduct(prepared: Prepared, out: Path, engine: Engine, watch: Watch) -> None:
    """Fly what is missing; what is done stays done.

    Args:
        prepared: the campaign.
        out: folder of the store.
        engine: flies tasks.
        watch: told after each task.

    Raises:
        BadInput: the folder holds another campaign.
        OSError: the disk is full, or the cluster is gone; what was done is kept.
    """
    several, text, folder = prepared
    attributes = {"campaign": text, "campaign_hash": text_hash(text), **versions()}
    store = Store(out / STORE, several.number, several.campaign.chunk, attributes)
    try:
        missing = store.missing()
        todo = sum(len(store.rows(number)) for number in missing)
        done, failed = several.number - todo, 0
        watch(done, several.number, failed)
        work = [(text, str(folder), store.rows(number)) for number in missing]
        notes = _notes(several)
        for i, columns in engine(tasks.fly, work):
            store.write(missing[i], columns, notes)
            done, failed = done + len(work[i][2]), failed + int(np.count_nonzero(columns["status"]))
            watch(done, several.number, failed)
    finally:
        store.close()


def _notes(several: Trials) -> dict[str, dict[str, Any]]:
    """What the numbers of a choice stand for."""
    named = {key: entries for key, entries in several.columns() if entries is not None}
    return {f"vary:{key}": {"choices": list(entries)} for key, entries in named.items()}
