"""What kind of file a text is, whether its keys and values are those of the schema, and what to say where not."""

import re
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from undertow.core.errors import BadInput, joined, known_key
from undertow.scenario.reading import Text, wrong_file
from undertow.scenario.schema import ONE_PART, SEVERAL_PARTS, Scenario
from undertow.scenario.schema_keys import keys, without_none
from undertow.scenario.synonyms import hint_for
from undertow.scenario.values import remedy_of
from undertow.scenario.vehicle_schema import KEYS as VEHICLE_KEYS

_LISTED = 5  # further wrong keys that a message names

_REMEDIES = {
    "campaign": "Run it: undertow campaign {name}",
    "vehicle file": "Name it in a scenario, as `plant: {{vehicle: {name}}}`; to check it alone: undertow check {name}",
}


def kind_of(data: Mapping[str, Any]) -> str:
    """What a file is by its keys: `campaign`, `vehicle file` or `scenario`; "" where it has no key of any."""
    if "scenario" in data:
        return "campaign"
    vehicle = sum(key in VEHICLE_KEYS for key in data)
    scenario = sum(key in Scenario.model_fields for key in data)
    return "vehicle file" if vehicle > scenario else "scenario" if scenario else ""


def validate(text: Text) -> Scenario:
    """Validate the contents of a scenario file.

    Raises:
        BadInput: unknown key, wrong type, value out of range; the error names key, location and nearest known word.
    """
    check_kind(text)
    try:
        return Scenario.model_validate(text.data)
    except ValidationError as errors:
        raise complaint(errors, text) from None


def check_kind(text: Text, key: str = "", where: str = "") -> None:
    """Check that a text is not another kind of file; `key` and `where` are the place that named it, if any.

    Raises:
        BadInput: it is.
    """
    if (kind := kind_of(text.data)) in _REMEDIES:
        name = text.name or "NAME.yaml"
        hint = _REMEDIES[kind].format(name=name)
        raise wrong_file(Path(name), key, "be a scenario", f"a {kind}", hint=hint, where=where)


def complaint(errors: ValidationError, text: Text, model: type[BaseModel] = Scenario) -> BadInput:
    """The first of pydantic's errors as BadInput, misspelt keys before others, and the names of the other keys."""
    first: Any
    line = lambda error: text.lines.get(_path_of(error), 0)
    first, *other_errors = sorted(errors.errors(), key=lambda error: (error["type"] != "extra_forbidden", line(error)))
    what, path, name = model.__name__.lower(), _path_of(first), _name_of(first)
    where, also = text.where(path), _also(first, other_errors, text)
    if first["type"] == "extra_forbidden":
        hint = _section_of(path, model) or hint_for(path, what) or known_key(str(path[-1]), _keys_beside(path, model))
        return BadInput(name, f"be a key of the {what}", "unknown", hint=joined(hint, also), where=where)
    if first["type"] == "missing":
        section, _, key = name.rpartition(".")
        parent = f"`{section}`" if section else f"the {what}"
        return BadInput(name, "be given", hint=joined(f"Add `{key}:` to {parent}", also), where=where)
    got = "empty" if first["input"] is None else _as_yaml(first["input"])
    return BadInput(name, _must(first), got, hint=joined(_remedy(first), also), where=where)


def _as_yaml(value: Any) -> str:
    """A value as a file has it, on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {_as_yaml(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_as_yaml, value))}]"
    return repr(value)


def _path_of(error: Any) -> tuple[str | int, ...]:
    return tuple(step for step in error["loc"] if step not in (ONE_PART, SEVERAL_PARTS))


def _name_of(error: Any) -> str:
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in _path_of(error)).lstrip(".")
    return " ".join(name.split())


def _also(first: Any, other_errors: Sequence[Any], text: Text) -> str:
    """Sentence with the other keys that are wrong; without those that a misspelt key leaves missing."""
    misspelt = {_path_of(error)[:-1] for error in (first, *other_errors) if error["type"] == "extra_forbidden"}
    other_errors = [
        error for error in other_errors if error["type"] != "missing" or _path_of(error)[:-1] not in misspelt
    ]
    lines = {_name_of(error): text.lines.get(_path_of(error)) for error in other_errors}
    named_keys = [
        f"`{name}`{f' (line {line})' if line else ''}" for name, line in lines.items() if name != _name_of(first)
    ]
    more = f" and {len(named_keys) - _LISTED} more" if len(named_keys) > _LISTED else ""
    return f"Also wrong: {', '.join(named_keys[:_LISTED])}{more}" if named_keys else ""


def _must(error: Any) -> str:
    """pydantic's 'Input should be ...' as the phrase after "must"."""
    message = error["msg"].replace("Input should be a valid ", "be a ").replace("Input should be ", "be ")
    message = message.replace("Value error, ", "").replace("Keys should be strings", "have words for keys")
    message = re.sub(r"\w+ should have at (\w+) (\d+) items?.*", r"have at \1 \2 entries", message)
    message = re.sub(r" or instance of \w+", "", message)
    return message.replace("be a integer", "be an integer").replace("a dictionary", "a mapping of keys to values")


def _remedy(error: Any) -> str:
    """How to write what was meant, where a number, true or false, or the space of `key: value` is missing."""
    kind, got = error["type"], error["input"]
    if "mapping" in _must(error) and isinstance(got, str) and re.fullmatch(r"[\w-]+:\S+", got):
        return "Write a space after the colon"
    return remedy_of(got, kind == "bool_type") if kind in ("float_type", "int_type", "bool_type") else ""


# Sections of parts whose names newcomers write at the top.
_INSIDE = {"vehicle": "plant", "thruster": "plant", "battery": "plant", "esc": "plant", "sensors": "navigation"}


def _section_of(path: tuple, model: type[BaseModel]) -> str:
    """Where a key at the top of a file belongs; "" for a key that no section has."""
    if len(path) == 1 and "scenario" in model.model_fields and path[0] in Scenario.model_fields:
        return "It is a key of the scenario"
    if model is not Scenario or len(path) != 1:
        return ""
    sections = [key.path.split(".") for key in keys()]
    inside = [steps[0] for steps in sections if len(steps) == 2 and steps[1] == path[0] != "kind"]
    section = next(iter(inside), _INSIDE.get(path[0]))
    kind = "kind: kalman, " if section == "navigation" else ""
    return f"It belongs to `{section}`: write `{section}: {{{kind}{path[0]}: ...}}`" if section else ""


def _keys_beside(path: tuple, model: Any) -> list[str]:
    for key in path[:-1]:
        if typing.get_origin(model) is dict:
            model = typing.get_args(model)[1]
            continue
        field = model.model_fields.get(key) if hasattr(model, "model_fields") else None
        model = without_none(field.annotation) if field is not None else None
    return list(model.model_fields) if hasattr(model, "model_fields") else []
