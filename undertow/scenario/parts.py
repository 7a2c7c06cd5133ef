"""Building parts from their descriptions: a part's own signature says what may be given."""

import inspect
import math
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.csv_table import read_samples

# Arguments that are parts themselves: their kind, and what they are when nothing is said.
INNER = {"vehicle": ("vehicles", "odin"), "thruster": ("thrusters", "paper_table3")}

# Kinds that are data: every declared parameter of theirs may be changed by name.
_ADJUSTABLE = ("vehicles", "thrusters")

_WORDS = {bool: "true or false", int: "an integer", float: "a number", str: "text", type(None): "null"}
_NUMBERS = float | list[float] | list[list[float]] | list[list[list[float]]]


def make(
    kind: str, description: str | Mapping[str, Any], folder: Path, given: tuple[Any, ...] = ()
) -> tuple[Any, dict[str, Any]]:
    """A part, and its description with every default filled in.

    Args:
        kind: folder of the catalogue.
        description: name, or mapping of `kind` (the name) and options.
        folder: where relative file names start.
        given: leading arguments that are not the user's.

    Raises:
        BadInput: anything wrong with the description; key names start at the part.
    """
    options = {"kind": description} if isinstance(description, str) else dict(description)
    name = options.pop("kind", None)
    if not isinstance(name, str):
        raise BadInput("kind", f"name one of the {kind}", name)
    try:
        function = catalogue.find(kind, name, folder)
    except BadInput as error:
        raise BadInput("kind", error.must, error.got, hint=error.hint) from None
    own = inspect.signature(function).parameters
    changes = {}
    if kind in _ADJUSTABLE:
        changes = {key: options.pop(key) for key in list(options) if key not in own}
    if "file" in options and "samples" in own:
        options["samples"] = read_samples(folder / str(options.pop("file")))
    part, resolved = call(function, options, given, folder)
    return adjust(part, changes) if changes else part, {"kind": _portable(name, folder), **resolved, **changes}


def call(
    function: Callable[..., Any], options: Mapping[str, Any], given: tuple[Any, ...] = (), folder: Path | None = None
) -> tuple[Any, dict[str, Any]]:
    """Result of a function called with checked options, and all options with their defaults.

    Raises:
        BadInput: unknown, missing or mistyped option, or the function's own complaint.
    """
    known = dict(list(inspect.signature(function).parameters.items())[len(given) :])
    for key in options:
        if key not in known:
            raise BadInput(key, "be an option here", "unknown", hint=did_you_mean(key, known) if known else "")
    hints = typing.get_type_hints(function)
    arguments, resolved = {}, {}
    for name, parameter in known.items():
        if name in INNER:
            kind, default = INNER[name]
            inner = options.get(name, default)
            if isinstance(inner, Mapping):
                inner = {"kind": default, **inner}
            elif not isinstance(inner, str):
                raise BadInput(name, "be a name, or a mapping with `kind` and options", inner)
            try:
                arguments[name], resolved[name] = make(kind, inner, folder or Path())
            except BadInput as error:
                raise error.at(name) from None
        elif name in options:
            arguments[name] = resolved[name] = _checked(name, options[name], hints.get(name), parameter.default)
        elif parameter.default is inspect.Parameter.empty:
            raise BadInput(name, "be given")
        else:
            arguments[name], resolved[name] = parameter.default, _listed(parameter.default)
    return function(*given, **arguments), resolved


def adjust(part: Any, changes: Mapping[str, Any]) -> Any:
    """Same part with some declared parameters replaced; those of parts inside it as nested mappings.

    Raises:
        BadInput: unknown parameter, wrong type or shape, or the part's own complaint.
    """
    fields = type(part).__dataclass_fields__
    values = {name: getattr(part, name) for name in fields}
    adjustable = [n for n, f in fields.items() if "unit" in f.metadata or isinstance(values[n], eqx.Module)]
    for key, change in changes.items():
        if key not in adjustable:
            raise BadInput(key, "be an option or parameter here", "unknown", hint=did_you_mean(key, adjustable))
        if isinstance(values[key], eqx.Module):
            if not isinstance(change, Mapping):
                raise BadInput(key, "be a mapping of parameters", change)
            try:
                values[key] = adjust(values[key], change)
            except BadInput as error:
                raise error.at(key) from None
        else:
            number = np.asarray(_checked(key, change, None, 0.0), dtype=float)
            if number.shape != np.shape(values[key]):
                raise BadInput(key, f"have shape {np.shape(values[key])}", f"of shape {number.shape}")
            values[key] = number
    return type(part)(**values)


def _checked(name: str, value: Any, hint: Any, default: Any) -> Any:
    """The value, if it is of the annotated type; numbers finite unless the default is infinite."""
    if value is None and default is None:
        return None
    kinds = typing.get_args(hint) or (hint,)
    plain = all(kind in _WORDS for kind in kinds)
    try:
        TypeAdapter(hint if plain else _NUMBERS, config=ConfigDict(strict=True)).validate_python(value)
    except ValidationError:
        must = " or ".join(_WORDS[kind] for kind in kinds) if plain else "a number or a list of numbers"
        raise BadInput(name, f"be {must}", repr(value)) from None
    if not isinstance(value, str):
        try:
            numbers = np.asarray(value, dtype=float)
        except ValueError:
            raise BadInput(name, "have rows of equal length", value) from None
        endless = isinstance(default, float) and math.isinf(default)
        if np.isnan(numbers).any() or (np.isinf(numbers).any() and not endless):
            raise BadInput(name, "be finite", value)
    return value


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in value] if isinstance(value, tuple) else value


def _portable(name: str, folder: Path) -> str:
    if ".py:" not in name:
        return name
    path, attribute = name.rsplit(":", 1)
    return f"{(folder / path).resolve()}:{attribute}"
