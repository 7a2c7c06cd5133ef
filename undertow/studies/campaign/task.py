"""A task: some trials, built and flown. It needs a text and two numbers, so that any process anywhere can do it."""

import contextlib
import functools
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import Built, build
from undertow.scenario.reading import Text
from undertow.scenario.workshop import Workshop
from undertow.studies.campaign.flying import Hangar
from undertow.studies.campaign.reading import read_text
from undertow.studies.campaign.trials import Trials, trials

# Trials of each combination that tell whether it can be flown, and which numbers differ.
_PROBES = 4

# Status of a trial whose scenario cannot be built, beside those of `undertow.core.status`.
REFUSED = -1


class Site(NamedTuple):
    """What a process keeps between tasks of one campaign."""

    trials: Trials
    workshop: Workshop
    hangar: Hangar
    probes: Callable[[], dict[int, Built]]  # of the first trials of every combination those that can be built


@functools.lru_cache(maxsize=2)
def site(text: str, folder: str) -> Site:
    """The campaign in this process.

    Args:
        text: of the campaign file.
        folder: where relative paths in it start.
    """
    several, workshop = trials(*read_text(text, Path(folder))), Workshop()
    probes = functools.cache(lambda: dict(_built(several, workshop, probed(several))))
    return Site(several, workshop, Hangar(lambda: list(probes().values())), probes)


def first_rows(several: Trials, combination: int) -> range:
    """The trials of a combination that are looked at before any is flown."""
    draws = several.campaign.trials
    return range(combination * draws, combination * draws + min(_PROBES, draws))


def probed(several: Trials) -> list[int]:
    """Those of all combinations."""
    return [row for one in range(len(several.combinations)) for row in first_rows(several, one)]


def fly(text: str, folder: str, rows: range) -> dict[str, np.ndarray]:
    """Columns of some trials: what differs between them, how they ended, and their metrics."""
    with runtime.on_processor():
        return _flown(site(text, folder), rows)


def _flown(here: Site, rows: range) -> dict[str, np.ndarray]:
    columns = {f"vary:{key}": column for key, column in _columns(here.trials, rows)}
    columns["seed"] = np.array([here.trials.seed(row) for row in rows], dtype=np.uint32)
    where: list[int] = []

    def flying() -> Iterator[Built]:
        for row, built in _built(here.trials, here.workshop, rows):
            where.append(row - rows.start)
            yield built

    flown = here.hangar.fly(flying(), here.trials.campaign.series)
    spread = functools.partial(_spread, len(rows), where)
    columns["status"] = spread(flown.status, REFUSED)
    columns["ended"] = spread(flown.ended, np.nan)
    columns["engine"] = spread(flown.engine, REFUSED)
    columns |= {name: spread(values, np.nan) for name, values in flown.metrics.items()}
    return columns | {f"series:{name}": spread(values, np.nan) for name, values in flown.series.items()}


def build_trial(several: Trials, workshop: Workshop, row: int) -> Built:
    """One trial, ready to run.

    Raises:
        BadInput: its scenario cannot be built.
    """
    scenario = several.scenario
    try:
        return build(Text(several.data(row), scenario.name, scenario.folder, scenario.lines), workshop)
    except BadInput as error:
        place = several.place(error.name) or error.where
        raise error.at(where=f"{place}, trial {row}" if place else f"trial {row}") from error.__cause__


def _built(several: Trials, workshop: Workshop, rows: Iterable[int]) -> Iterator[tuple[int, Built]]:
    """Those trials that can be built, one after another: a task of many does not hold them all."""
    for row in rows:
        with contextlib.suppress(BadInput):
            yield row, build_trial(several, workshop, row)


def _columns(several: Trials, rows: range) -> Iterable[tuple[str, np.ndarray]]:
    """Values of what differs; the number of the choice where they are not numbers."""
    values = [several.values(row) for row in rows]
    for key, entries in several.columns():
        pick: Any = float if entries is None else list(entries.values()).index
        yield key, np.array([pick(one[key]) for one in values], dtype=float)


def _spread(count: int, where: list[int], values: np.ndarray, empty: Any) -> np.ndarray:
    """Values at their rows, `empty` elsewhere."""
    whole = np.full((count, *values.shape[1:]), empty, dtype=values.dtype)
    whole[where] = values
    return whole
