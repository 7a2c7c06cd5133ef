"""A task: some trials, built and flown. It needs a text and two numbers, so that any process anywhere can do it."""

import contextlib
import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.campaign.batch_runner import ProgramCache
from undertow.campaign.layout import Layout
from undertow.campaign.reading import read_text
from undertow.campaign.trials import Trials, trials
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import Built, build
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import Text

# Status of a trial whose scenario cannot be built, beside those of `undertow.core.status`.
REFUSED = -1


class Site(NamedTuple):
    """What a process keeps between tasks of one campaign."""

    trials: Trials
    part_cache: PartCache
    programs: ProgramCache
    probes: Callable[[], dict[int, Built]]  # of the first trials of every combination those that can be built


@functools.lru_cache(maxsize=2)
def site(text: str, folder: str) -> Site:
    """The campaign in this process.

    Args:
        text: of the campaign file.
        folder: where relative paths in it start.
    """
    several, part_cache = trials(*read_text(text, Path(folder))), PartCache()
    rows = several.probes()
    probes = functools.cache(lambda: {rows[place]: built for place, built in _built(several, part_cache, rows)})
    return Site(several, part_cache, ProgramCache(lambda: list(probes().values())), probes)


def run_block(text: str, folder: str, layout: Layout, task: int) -> dict[str, np.ndarray]:
    """Columns of the trials of a task."""
    return fly(text, folder, layout.trials(task).tolist())


def fly(text: str, folder: str, rows: Sequence[int]) -> dict[str, np.ndarray]:
    """Columns of some trials: what is drawn for them, how they ended, and their metrics.

    Args:
        text: of the campaign file.
        folder: where relative paths in it start.
        rows: numbers of the trials.
    """
    with runtime.on_processor():
        return _ran(site(text, folder), rows)


def _ran(here: Site, rows: Sequence[int]) -> dict[str, np.ndarray]:
    columns = {f"vary:{key}": column for key, column in _columns(here.trials, rows)}
    columns["trial"] = np.array(rows, dtype=np.uint32)
    columns["seed"] = np.array([here.trials.seed(row) for row in rows], dtype=np.uint32)
    where: list[int] = []

    def flying() -> Iterator[Built]:
        for place, built in _built(here.trials, here.part_cache, rows):
            where.append(place)
            yield built

    flown = here.programs.run(flying(), here.trials.campaign.series)
    spread = functools.partial(_spread, len(rows), where)
    columns["status"] = spread(flown.status, REFUSED)
    columns["ended"] = spread(flown.ended, np.nan)
    columns["backend"] = spread(flown.backend, REFUSED)
    found = flown.metrics | {f"series:{name}": values for name, values in flown.series.items()}
    if "precision" in here.trials.campaign.keys:  # one array holds both
        found = {name: values.astype(np.float64) for name, values in found.items()}
    return columns | {name: spread(values, np.nan) for name, values in found.items()}


def build_trial(several: Trials, part_cache: PartCache, row: int) -> Built:
    """One trial, ready to run.

    Raises:
        BadInput: its scenario cannot be built.
    """
    try:
        return build_data(several, part_cache, several.data(row))
    except BadInput as error:
        place = several.place(error.name) or error.where
        raise error.at(where=f"{place}, trial {row}" if place else f"trial {row}") from error.__cause__


def build_data(several: Trials, part_cache: PartCache, data: dict[str, Any]) -> Built:
    """A scenario that stands where that of the trials does.

    Raises:
        BadInput: it cannot be built.
    """
    scenario = several.scenario
    return build(Text(data, scenario.name, scenario.folder, scenario.lines), part_cache)


def _built(several: Trials, part_cache: PartCache, rows: Iterable[int]) -> Iterator[tuple[int, Built]]:
    """Place among the rows, and trial, of those that can be built; a task of many does not hold them all."""
    for place, row in enumerate(rows):
        with contextlib.suppress(BadInput):
            yield place, build_trial(several, part_cache, row)


def _columns(several: Trials, rows: Sequence[int]) -> Iterable[tuple[str, np.ndarray]]:
    """Values of what is drawn; the number of the choice where they are not numbers."""
    values = [several.values(row) for row in rows]
    for key, entries in several.columns():
        pick: Any = float if entries is None else list(entries.values()).index
        yield key, np.array([pick(one[key]) for one in values], dtype=float)


def _spread(count: int, where: list[int], values: np.ndarray, empty: Any) -> np.ndarray:
    """Values at their rows, `empty` elsewhere."""
    whole = np.full((count, *values.shape[1:]), empty, dtype=values.dtype)
    whole[where] = values
    return whole
