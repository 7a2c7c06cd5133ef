"""Candidates of a comparison: controllers by name, file or options, and whole scenarios."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario import factory
from undertow.scenario.build import Built, build
from undertow.scenario.reading import Text, from_data, read
from undertow.scenario.schema import Part, named_law
from undertow.scenario.validation import validate
from undertow.studies.campaign.labels import words

OWN = "scenario"  # stands for the controller of the scenario itself
_FILES = (".yaml", ".yml", ".nc")

# Keys of a scenario in which candidates do not differ: each trial has its own seed, and the rest is not simulated.
_NOT_COMPARED = {"description", "seed", "tune"}


class Candidate(NamedTuple):
    """One side of a comparison.

    Attributes:
        name: in tables and figures.
        changes: key path of the scenario -> value, like an entry of `variants` in a campaign.
        source: the scenario file that the gains come from; None where a name or options were given.
    """

    name: str
    changes: dict[str, Any]
    source: Path | None


def entries_of(text: str) -> list[str]:
    """Entries of a list that a user writes, such as `robust, pid`."""
    return [word for word in map(str.strip, text.split(",")) if word]


def controllers(entries: Sequence[str] | Mapping[str, Any], scenario: Text, path: Path | None) -> list[Candidate]:
    """Controllers that are compared on one scenario.

    Args:
        entries: such as `robust`, `pid`, `./mine.py:smc`, `tuned.yaml`, `scenario` or `NAME=ENTRY`; or name ->
            entry, where an entry may also be a mapping like the key `controller` of a scenario.
        scenario: the scenario.
        path: its file, for the entry `scenario`; None where it has none.

    Raises:
        BadInput: fewer than two, or one of them is no controller.
    """
    pairs = entries.items() if isinstance(entries, Mapping) else map(_split, entries)
    scenario_candidate = lambda name: _own(name, scenario, path)
    candidates = [scenario_candidate(name) if entry == OWN else _controller(name, entry) for name, entry in pairs]
    if len(candidates) < 2:
        hint = "For example: --controllers robust,pid. The word `scenario` stands for the scenario's own controller"
        raise BadInput("--controllers", "name at least two controllers", len(candidates), hint=hint)
    return _unique(candidates)


def laws(entries: Sequence[str]) -> list[Candidate]:
    """Controllers that need no scenario: entries as of `controllers`, but for `scenario`.

    Raises:
        BadInput: one of them is no controller.
    """
    return _unique([_controller(name, entry) for name, entry in map(_split, entries)])


def scenarios(paths: Sequence[Path], allow_code: bool) -> tuple[Text, list[Candidate], dict[str, list[str]]]:
    """Scenarios that are compared as a whole.

    Returns:
        The first of them, with the contents of all files that it names; the candidates; and what differs, as key ->
        the value in each.

    Raises:
        BadInput: one of the scenarios is invalid.
    """
    texts = [read(path, allow_code=allow_code) for path in paths]
    for path, text in zip(paths, texts, strict=True):
        if "scenario" in text.data:
            hint = "A campaign file is compared alone: its own `cross` or `variants`, or with --controllers"
            raise BadInput(str(path), "be a scenario where several are given", "a campaign", hint=hint)
    resolved = [build(text).resolved for text in texts]
    flat_scenarios = [_flat(data) for data in resolved]
    keys = dict.fromkeys(key for data in flat_scenarios for key in data)
    differs = lambda key: any(data.get(key) != flat_scenarios[0].get(key) for data in flat_scenarios)
    different = [key for key in keys if differs(key)]
    stems = [path.stem for path in paths]
    names = [f"{path.parent.name}/{path.stem}" if stems.count(path.stem) > 1 else path.stem for path in paths]
    # A scenario may be without metrics of its own, faults and a supervisor.
    empty_values = {key: None if key == "supervisor" else [] for key in different}
    candidates = []
    for name, data, path in zip(names, flat_scenarios, paths, strict=True):
        changes = {key: data.get(key, empty_values[key]) for key in different}
        candidates.append(Candidate(name, changes, path))
    return from_data(resolved[0])._replace(folder=texts[0].folder), _unique(candidates), _differing(texts)


def _differing(texts: Sequence[Text]) -> dict[str, list[str]]:
    """Key -> its value in each scenario as the user wrote it, for the keys that differ."""
    flat_scenarios = [_flat(validate(text).model_dump()) for text in texts]
    keys = dict.fromkeys(key for data in flat_scenarios for key in data)
    values_by_key = {key: [words(data.get(key, "not given")) or "none" for data in flat_scenarios] for key in keys}
    return {key: values for key, values in values_by_key.items() if len(set(values)) > 1}


def _flat(data: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a scenario that decide its runs; those of sections that are no parts one by one, as `loop.dt`."""
    flat: dict[str, Any] = {}
    for key, value in data.items():
        if key in _NOT_COMPARED:
            continue
        if key in ("loop", "steady") and isinstance(value, Mapping):
            flat |= {f"{key}.{inner}": inner_value for inner, inner_value in value.items()}
        else:
            flat[key] = value
    return flat


def _split(entry: str) -> tuple[str, str]:
    """Name and entry of `NAME=ENTRY`; no name where there is none."""
    name, equals, value = entry.partition("=")
    return (name.strip(), value.strip()) if equals else ("", entry.strip())


def _own(name: str, scenario: Text, path: Path | None) -> Candidate:
    """The controller of the scenario itself."""
    part = part_of(validate(scenario).controller, scenario.folder)
    return Candidate(name or f"{label(part)} (scenario)", {"controller": part}, path)


def _controller(name: str, entry: Any) -> Candidate:
    if isinstance(entry, Mapping):
        part = named_law(from_data(entry).data)
        return Candidate(name or label(part), {"controller": part}, None)
    if not isinstance(entry, str) or not entry:
        raise BadInput("--controllers", "name controllers, separated by commas", repr(entry))
    if entry.endswith(_FILES):
        return _of_file(name, Path(entry))
    part = _named(entry)
    return Candidate(name or label(part), {"controller": part}, None)


def _of_file(name: str, path: Path) -> Candidate:
    """The controller of a scenario file, of `tuned.yaml` for example."""
    text = read(path, "--controllers")
    part = part_of(validate(text).controller, text.folder)
    return Candidate(name or f"{label(part)} ({path.stem})", {"controller": part}, path)


def part_of(controller: Part, folder: Path) -> dict[str, Any]:
    """A controller of a scenario in `folder` as data that any other scenario may have."""
    data = controller.model_dump()
    return data | {"kind": factory.portable_name(data["kind"], folder)}


def scenario_with(candidate: Candidate, scenario: Text) -> Text:
    """A scenario with the controller of a candidate, and without ranges for tuning that are those of another law."""
    data = dict(scenario.data)
    part = candidate.changes["controller"]
    tune_section = data.get("tune")
    if isinstance(tune_section, dict) and "parameters" in tune_section:
        scenario_controller = part_of(validate(scenario).controller, scenario.folder)
        if any(scenario_controller.get(key) != part.get(key) for key in ("kind", "preset")):
            data["tune"] = {key: value for key, value in tune_section.items() if key != "parameters"}
    return scenario._replace(data=data | candidate.changes)


def built_with_each(entries: Sequence[str], scenario: Text, path: Path | None) -> dict[str, Built]:
    """Name -> the scenario built with that controller, for entries as of `controllers`.

    Raises:
        BadInput: fewer than two, or the scenario cannot be built with one of them.
    """
    return {
        candidate.name: build(scenario_with(candidate, scenario)) for candidate in controllers(entries, scenario, path)
    }


def _named(entry: str) -> dict[str, Any]:
    """A controller by the name of a preset, by its own name, or by a file of Python code and a function."""
    if catalogue.is_user_code(entry):
        catalogue.find("controllers", entry, Path(), "--controllers")
        return {"kind": factory.portable_name(entry, Path())}
    presets, parts = catalogue.presets("controllers"), catalogue.names("controllers")
    if entry in presets or entry in parts:
        return catalogue.spelled_out("controllers", {"kind": entry})
    hint = f"Name the function as well: {entry}:FUNCTION" if entry.endswith(".py") else ""
    choices = [*presets, *parts, OWN]
    must = "name presets, controllers, ./file.py:function or scenario files"
    raise BadInput("--controllers", must, entry, hint=hint or did_you_mean(entry, choices))


def label(part: Mapping[str, Any]) -> str:
    """Short name of a controller: its preset, its function or its kind."""
    return str(part.get("preset") or part["kind"].rpartition(":")[2])


def file_stem(number: int, name: str) -> str:
    """Name of the files of a candidate: its number, from 0, and its name in letters of every file system."""
    return f"{number + 1}-{in_letters(name)}"


def in_letters(name: str) -> str:
    """A name in letters of every file system."""
    return re.sub(r"[^a-zA-Z0-9_-]+", "-", name).strip("-")


def _unique(candidates: Sequence[Candidate]) -> list[Candidate]:
    """With a number behind names that occur again."""
    names: list[str] = []
    for candidate in candidates:
        number = 1 + sum(earlier.name == candidate.name for earlier in candidates[: len(names)])
        names.append(candidate.name if number == 1 else f"{candidate.name} {number}")
    return [candidate._replace(name=name) for candidate, name in zip(candidates, names, strict=True)]
