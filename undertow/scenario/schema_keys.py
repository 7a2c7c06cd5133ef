"""Every key of a scenario file with its type, default and meaning, as `undertow describe scenario` lists them."""

import typing
from collections.abc import Iterator
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel

from undertow.scenario.schema import Fault, NamedPart, Numbers, OneOrMore, Part, Scenario, Strict


class Key(NamedTuple):
    """One key of a scenario file."""

    path: str
    type: str
    default: Any  # "required" when there is none
    meaning: str


def keys(model: type[BaseModel] = Scenario, prefix: str = "", defaults: BaseModel | None = None) -> Iterator[Key]:
    """Every key a scenario may have, nested ones included.

    Args:
        model: with the keys.
        prefix: goes before them.
        defaults: a section with default values, where these are not those of its class.
    """
    for name, field in model.model_fields.items():
        inner = field.annotation if isinstance(field.annotation, type) else None
        meaning, _, stated_default = (field.description or "").partition("; default: ")
        default = getattr(defaults, name) if defaults else field.get_default(call_default_factory=True)
        if inner is not None and issubclass(inner, Strict):
            yield Key(f"{prefix}{name}", "mapping", "see below", meaning)
            yield from keys(inner, f"{prefix}{name}.", default)
        else:
            default_text = default.kind if isinstance(default, Part) else "required" if field.is_required() else default
            yield Key(f"{prefix}{name}", _type_name(field.annotation), stated_default or default_text, meaning)


def _type_name(annotation: Any) -> str:
    if annotation is Part:
        return "part"
    annotation = without_none(annotation)
    if typing.get_origin(annotation) is Literal:
        return " or ".join(typing.get_args(annotation))
    if typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    words = {
        float: "number",
        bool: "true or false",
        int: "integer",
        str: "text",
        Numbers: "list of numbers",
        list[str]: "list of names",
        list[Any]: "list of values",
        list[NamedPart]: "list of parts",
        list[Fault]: "list of faults",
        typing.get_args(OneOrMore)[0]: "part or list of parts",
        str | dict[str, Any]: "name of a file, or mapping",
    }
    return words.get(annotation, "mapping")


def without_none(annotation: Any) -> Any:
    """The type of an optional value without None."""
    members = typing.get_args(annotation)
    types = [member for member in members if member is not type(None)]
    return types[0] if len(types) == 1 < len(members) else annotation
