"""A law as it enters the arena: one campaign whose variants are the tasks, and the folder that keeps its results."""

import itertools
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.studies.arena.tasks import CELLS, VERSION, Keys, scenarios
from undertow.studies.arena.tuned_gains import TunedGains, controller_of
from undertow.studies.campaign.campaign_schema import validate
from undertow.studies.campaign.prepare import Prepared, prepare_campaign
from undertow.studies.comparison.candidates import Candidate, in_letters

LAWS, ENTRY = "laws", "entry.json"

Cell = tuple[str, str]  # task and vehicle


class Entry(NamedTuple):
    """What is kept of a law beside the results of its trials.

    Attributes:
        name: in tables and figures.
        version: of the arena.
        controller: part `controller` of its scenarios, without tuned gains.
        cells: tasks and vehicles that it ran, or runs.
        refused: task and vehicle -> why no scenario could be built; such a task counts as lost.
        gains: how its gains came about, for each vehicle.
    """

    name: str
    version: int
    controller: dict[str, Any]
    cells: tuple[Cell, ...]
    refused: dict[Cell, str]
    gains: dict[str, str]


def folder_of(out: Path, name: str) -> Path:
    """Folder of a law among the results of an arena."""
    return out / LAWS / in_letters(name)


def prepare_entry(
    law: Candidate, trials: int, cells: Sequence[Cell] = CELLS, gains: TunedGains | None = None
) -> tuple[Entry, Prepared]:
    """The campaign of a law: variants for every task and vehicle that it accepts.

    Args:
        law: the law.
        trials: of every task on every vehicle.
        cells: tasks and vehicles.
        gains: tuned for each vehicle; None for those that the law has by itself.

    Returns:
        What is kept of the law, and its campaign.

    Raises:
        BadInput: the law accepts no task, or the campaign cannot be built.
    """
    variants = {cell: with_law(cell, law, gains) for cell in cells}
    refused: dict[Cell, str] = {}
    try:
        prepared = campaign_of(dict(itertools.chain(*(of_cell.items() for of_cell in variants.values()))), trials)
    except BadInput:
        refused = {cell: why for cell in cells if (why := _why_not(variants[cell]))}
        if len(refused) in (0, len(cells)):
            raise
        accepted = [of_cell.items() for cell, of_cell in variants.items() if cell not in refused]
        prepared = campaign_of(dict(itertools.chain(*accepted)), trials)
    sentences = {} if gains is None else gains.sentences
    return Entry(law.name, VERSION, law.changes["controller"], tuple(cells), refused, sentences), prepared


def with_law(cell: Cell, law: Candidate, gains: TunedGains | None) -> dict[str, Keys]:
    """The scenarios of a task on a vehicle with a law, by their names."""
    controller = controller_of(law, cell[1], gains)
    return {name: keys | {"controller": controller} for name, keys in scenarios(*cell).items()}


def campaign_of(variants: dict[str, Keys], trials: int) -> Prepared:
    """A campaign whose variants are whole scenarios with the same keys."""
    data = {"scenario": next(iter(variants.values())), "trials": trials, "variants": variants}
    text = from_data(data)
    return prepare_campaign(validate(text), text)


def _why_not(variants: dict[str, Keys]) -> str:
    """Why one of the scenarios cannot be built; empty where all can."""
    try:
        for keys in variants.values():
            build(from_data(keys))
    except BadInput as error:
        return str(error)
    return ""


def write_entry(entry: Entry, folder: Path) -> None:
    """Write what is kept of a law."""
    data = entry._asdict() | {"refused": [[*cell, why] for cell, why in entry.refused.items()]}
    write_whole(folder / ENTRY, to_json(data, indent=1) + "\n")


def read_entry(folder: Path) -> Entry:
    """What is kept of a law.

    Raises:
        BadInput: the file cannot be read, or is of another version of the arena.
    """
    file = folder / ENTRY
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        version = data["version"]
        as_text: Callable[[Any], str] = lambda value: value if isinstance(value, str) else _fail(value)
        entry = Entry(
            as_text(data["name"]),
            int(version),
            dict(data["controller"]),
            tuple((as_text(task), as_text(vehicle)) for task, vehicle in data["cells"]),
            {(as_text(task), as_text(vehicle)): as_text(why) for task, vehicle, why in data["refused"]},
            {as_text(vehicle): as_text(sentence) for vehicle, sentence in data["gains"].items()},
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        hint = f"Remove the folder {folder}, and run the arena again for this law"
        raise BadInput("--out", "have entries that can be read", f"{file}: {error!r}", hint=hint) from None
    if entry.version != VERSION:
        hint = "Results of different versions cannot be compared: choose another folder"
        raise BadInput("--out", f"be of version {VERSION} of the arena", f"version {version} in {file}", hint=hint)
    return entry


def _fail(value: Any) -> str:
    raise TypeError(f"{value!r} is no text")
