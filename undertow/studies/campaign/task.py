"""A task: some trials, built and flown. It needs a text and two numbers, so that any process anywhere can do it."""

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.scenario.build import Built, build
from undertow.scenario.reading import Text
from undertow.scenario.workshop import Workshop
from undertow.studies.campaign.flying import Hangar
from undertow.studies.campaign.reading import read_text
from undertow.studies.campaign.trials import Trials, trials

# Status of a trial whose scenario cannot be built, beside those of `undertow.core.status`.
REFUSED = -1


class Site(NamedTuple):
    """What a process keeps between tasks of one campaign."""

    trials: Trials
    workshop: Workshop
    hangar: Hangar


@functools.lru_cache(maxsize=2)
def site(text: str, folder: str) -> Site:
    """The campaign in this process.

    Args:
        text: of the campaign file.
        folder: where relative paths in it start.
    """
    return Site(trials(read_text(text), Path(folder)), Workshop(), Hangar())


def fly(text: str, folder: str, rows: range) -> dict[str, np.ndarray]:
    """Columns of some trials: what differs between them, how they ended, and their metrics."""
    here = site(text, folder)
    asked = here.trials.campaign.series
    built = {row: one for row in rows if (one := _built(here, row)) is not None}
    columns = {f"vary:{key}": column for key, column in _columns(here.trials, rows)}
    columns["seed"] = np.array([here.trials.seed(row) for row in rows], dtype=np.uint32)
    kept = (tuple(asked.signals), asked.every) if asked else ()
    flown = here.hangar.fly(list(built.values()), *kept)
    where = np.array([row - rows.start for row in built], dtype=int)
    spread = functools.partial(_spread, len(rows), where)
    columns["status"] = spread(flown.status, REFUSED)
    columns["ended"] = spread(flown.ended, np.nan)
    columns |= {name: spread(values, np.nan) for name, values in flown.metrics.items()}
    return columns | {f"series:{name}": spread(values, np.nan) for name, values in flown.series.items()}


def build_trial(here: Site, row: int) -> Built:
    """One trial, ready to run.

    Raises:
        BadInput: its scenario cannot be built.
    """
    scenario = here.trials.scenario
    try:
        return build(Text(here.trials.data(row), scenario.name, scenario.folder, scenario.lines), here.workshop)
    except BadInput as error:
        raise error.at(where=f"trial {row}") from error.__cause__


def _built(here: Site, row: int) -> Built | None:
    try:
        return build_trial(here, row)
    except BadInput:
        return None


def _columns(several: Trials, rows: range) -> Iterable[tuple[str, np.ndarray]]:
    """Values of what differs; the number of the choice where they are not numbers."""
    values = [several.values(row) for row in rows]
    for key, entries in several.columns():
        pick: Any = float if entries is None else list(entries.values()).index
        yield key, np.array([pick(one[key]) for one in values], dtype=float)


def _spread(count: int, where: np.ndarray, values: np.ndarray, empty: Any) -> np.ndarray:
    """Values at their rows, `empty` elsewhere."""
    whole = np.full((count, *values.shape[1:]), empty, dtype=values.dtype)
    whole[where] = values
    return whole
