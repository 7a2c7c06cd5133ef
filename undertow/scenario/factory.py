"""Build parts from their descriptions; the signature of a part defines its options."""

import functools
import inspect
import typing
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np

from undertow.core import catalogue, checks, contracts
from undertow.core.arrays import as_array
from undertow.core.composite_model import parts_of
from undertow.core.errors import BadInput, error_location, joined, known_key
from undertow.core.metric import AbstractMetric
from undertow.core.user_code import RAISED, fault_of, place_of
from undertow.logs.log import Log
from undertow.physics.faults.mode import AbstractFault
from undertow.physics.power import ESC, Battery
from undertow.physics.sensors.sensor import AbstractSensor
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario.csv_table import csv_of, read_csv, samples_of
from undertow.scenario.log_file import read_log
from undertow.scenario.values import checked
from undertow.scenario.vehicle_file import is_vehicle_file, read_vehicle

# Argument of a controller that applies another law to each subsystem of a plant.
_LAW = "law"

# Arguments that are parts themselves: their kind, and the default part; a tuple for a list of parts.
INNER = {
    "vehicle": ("vehicles", "odin"),
    "thruster": ("thrusters", "paper_table3"),
    "battery": ("power", "battery"),
    "esc": ("power", "esc"),
    "sensors": ("sensors", ("imu", "dvl", "depth", "compass", "position_fix")),
    "second_vehicle": ("vehicles", "odin"),
    _LAW: ("controllers", "robust"),
}

# Arguments that are tables of samples, which a file can give.
_TABLES = ("samples", "commands")

# Kinds that are data: a scenario may change every declared parameter by name.
_ADJUSTABLE = ("vehicles", "thrusters")

_CONTRACTS = {
    "vehicles": VehicleModel,
    "thrusters": AbstractThruster,
    "power": Battery | ESC,
    "plants": contracts.AbstractPlant,
    "controllers": contracts.AbstractController,
    "disturbances": contracts.AbstractDisturbance,
    "references": contracts.AbstractReference,
    "sensors": AbstractSensor,
    "navigation": contracts.AbstractNavigation,
    "supervision": contracts.AbstractController,
    "faults": AbstractFault,
    "metrics": AbstractMetric,
}

_VARIABLE = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def make(
    kind: str,
    description: str | Mapping[str, Any],
    folder: Path,
    leading_arguments: tuple[Any, ...] = (),
    context: Mapping[str, Any] | None = None,
) -> tuple[Any, dict[str, Any]]:
    """A part, and its description with every default filled in.

    Args:
        kind: folder of the catalogue.
        description: name, or mapping of `kind` (the name) and options; a vehicle's name may be that of a YAML file.
        folder: folder of relative file names.
        leading_arguments: those that do not come from the user.
        context: defaults of options that follow from the rest of a scenario.

    Raises:
        BadInput: the description is invalid; key names start at the part.
    """
    options = catalogue.spelled_out(kind, {"kind": description} if isinstance(description, str) else description)
    name = options.pop("kind", None)
    if not isinstance(name, str):
        raise BadInput("kind", f"name one of the {kind}", name)
    if kind == "vehicles" and is_vehicle_file(name):
        vehicle_file = read_vehicle(folder / name, options)
        return vehicle_file.vehicle(), {
            "kind": Path(name).name,
            "contents": vehicle_file.contents,
        }  # independent of the file
    function, preset = _preset(catalogue.find(kind, name, folder, "kind"), options)
    parameters = inspect.signature(function).parameters
    options = {key: value for key, value in (context or {}).items() if key in parameters} | options
    changes, table = {}, {}
    if kind in _ADJUSTABLE:
        changes = {key: options.pop(key) for key in list(options) if key not in parameters}
    if argument := next((name for name in _TABLES if name in parameters), ""):
        rows_of_log = getattr(function, "rows_of_log", None)
        table = _samples(options, folder, argument, rows_of_log and (lambda log: rows_of_log(log, *leading_arguments)))
    part, resolved = call(function, options, leading_arguments, folder, context)
    if not isinstance(part, _CONTRACTS[kind]):
        must = f"name a function that returns {_title(_CONTRACTS[kind])}"
        if part is None:
            raise BadInput("kind", must, f"{name}, which returns nothing", hint="Does the function lack a `return`?")
        got = f"{name}, which returns {_described(part)}"
        raise BadInput("kind", must, got, hint=derive_hint(part, kind) if place_of(part) else "")
    if table:
        del resolved[argument]
    part = adjust(part, changes, tuple(parameters)) if changes else part
    return part, {"kind": portable_name(name, folder), **preset, **resolved, **changes, **table}


def call(
    function: Callable[..., Any],
    options: Mapping[str, Any],
    leading_arguments: tuple[Any, ...] = (),
    folder: Path | None = None,
    context: Mapping[str, Any] | None = None,
) -> tuple[Any, dict[str, Any]]:
    """Result of a function called with checked options, and all options with their defaults.

    Args:
        function: that makes the part, or another one.
        options: from the user.
        leading_arguments: those that do not come from the user.
        folder: folder of relative file names.
        context: defaults of options of an inner law, as of `make`.

    Raises:
        BadInput: unknown, missing or mistyped option, or an error of the function.
    """
    declared = _declared_once if inspect.isfunction(function) else _declared
    signature, hints = declared(function)
    parameters = {name: option for name, option in signature[len(leading_arguments) :] if option.kind not in _VARIABLE}
    if unknown := [str(key) for key in options if key not in parameters]:
        hint = known_key(unknown[0], parameters) if parameters else "There are none: remove it"
        also = f"Also unknown: {', '.join(f'`{key}`' for key in unknown[1:])}" if unknown[1:] else ""
        raise BadInput(unknown[0], "be an option here", "unknown", hint=joined(hint, also))
    arguments, resolved = {}, {}
    for name, parameter in parameters.items():
        if name == _LAW:
            description = options.get(name, INNER[_LAW][1])
            arguments[name], resolved[name] = _law_of_each(
                description, leading_arguments, folder or Path(), context or {}
            )
        elif name in INNER:
            description = options.get(name, inner_default(name, parameter))
            if description is parameter.default is None:
                arguments[name], resolved[name] = None, None
            else:
                arguments[name], resolved[name] = _inner(name, description, folder)
        elif name in options:
            value = checked(name, options[name], hints.get(name), parameter.default)
            if catalogue.FILE in getattr(parameter.annotation, "__metadata__", ()):
                value = whole_name(value, folder or Path())
            arguments[name] = resolved[name] = value
        elif parameter.default is inspect.Parameter.empty:
            raise _missing(function, name, leading_arguments)
        else:
            arguments[name], resolved[name] = parameter.default, listed(parameter.default)
    return _made(lambda: function(*leading_arguments, **arguments)), resolved


def adjust(part: Any, changes: Mapping[str, Any], options: Sequence[str] = ()) -> Any:
    """The same part with some declared parameters replaced; parameters of inner parts as nested mappings.

    Args:
        part: the part.
        changes: new values by name.
        options: other valid names, for suggestions.

    Raises:
        BadInput: unknown parameter, wrong type or shape, or an error of the part.
    """
    fields = type(part).__dataclass_fields__
    values = {name: getattr(part, name) for name in fields}
    adjustable = [n for n, f in fields.items() if "unit" in f.metadata or isinstance(values[n], eqx.Module)]
    for key, change in changes.items():
        if key not in adjustable:
            raise BadInput(
                key, "be an option or parameter here", "unknown", hint=known_key(str(key), [*options, *adjustable])
            )
        if isinstance(values[key], eqx.Module):
            if not isinstance(change, Mapping):
                raise BadInput(key, "be a mapping of parameters", change)
            with error_location(key):
                values[key] = adjust(values[key], change)
        else:
            number: Any = checked(key, change, None, 0.0)
            number = as_array(number) if checks.traced(number) else np.asarray(number, dtype=float)
            if number.shape != np.shape(values[key]):
                raise BadInput(
                    key, _sized(np.shape(values[key])), f"of shape {number.shape}" if number.shape else change
                )
            values[key] = number
    return _made(lambda: type(part)(**values))


def takes_model(function: Callable[..., Any]) -> bool:
    """Whether a function makes a controller: its first argument is the nominal model, which undertow gives."""
    return next(iter(inspect.signature(function).parameters), "") == "model"


def is_part(thing: Any) -> bool:
    """Whether an object keeps the contract of some kind of part."""
    return isinstance(thing, tuple(_CONTRACTS.values()))


def kind_of_part(part: Any) -> str:
    """Kind of a part, by the contract that it keeps."""
    return next(kind for kind, contract in _CONTRACTS.items() if isinstance(part, contract))


def _described(thing: Any) -> str:
    """An object that is no part, for messages: of a class of the user's own its name and place."""
    location = place_of(thing)
    return f"a `{type(thing).__name__}` ({location})" if location else repr(thing)


def derive_hint(thing: Any, kind: str = "") -> str:
    """From which contract to derive the class of the user's own of an object that is no part.

    Args:
        thing: the object.
        kind: folder of the catalogue, where that is known.
    """
    contract, shared = contract_like(thing, kind)
    class_name = type(thing).__name__
    if not contract:
        return f"Derive `{class_name}` from the contract of its kind, such as AbstractController"
    has = f": it has {', '.join(f'`{method}`' for method in shared)}" if shared else ""
    return f"Derive `{class_name}` from {contract}{has}"


def _missing(function: Callable[..., Any], name: str, leading_arguments: tuple[Any, ...]) -> BadInput:
    """The error for an option without a value; for a function of the user's own with its place and the remedy."""
    location = place_of(function)
    if not location:
        return BadInput(name, "be given")
    file = Path(inspect.getsourcefile(function) or "")
    function_name = function.__name__
    if inspect.isclass(function):
        must = f"be given: `{function_name}` ({location}) is a class, and a part is named by a function that makes it"
        return BadInput(name, must, hint=catalogue.maker_in(file, file.name))
    must = f"be given: `{function_name}` ({location}) has no default for it"
    first = next(iter(inspect.signature(function).parameters))
    if first == "model":
        return BadInput(name, must, hint=f"Give it one: `def {function_name}(model, {name}=1.0)`, for example")
    hint = (
        f"{'A' if leading_arguments else 'Give it one. A'} function that makes a controller takes `model` first, and "
        "returns an AbstractController: `undertow init --own-controller` writes one"
    )
    return BadInput(name, must, hint=hint)


def contract_like(thing: Any, kind: str = "") -> tuple[str, list[str]]:
    """Name of the contract of which something has most methods, and these; "" where it has none of any.

    Args:
        thing: an object.
        kind: folder of the catalogue, whose contract is the one; "" where that is not known.
    """
    contracts = [_CONTRACTS[kind]] if kind else _CONTRACTS.values()
    kinds = [candidate for contract in contracts for candidate in typing.get_args(contract) or (contract,)]
    shared = {}
    for candidate in kinds:
        methods = getattr(candidate, "__abstractmethods__", ())
        shared[candidate] = [name for name in methods if hasattr(thing, name)]
    nearest = max(kinds, key=lambda candidate: len(shared[candidate]))
    return (nearest.__name__ if kind or shared[nearest] else ""), sorted(shared[nearest])


def _preset(function: Callable[..., Any], options: dict[str, Any]) -> tuple[Callable[..., Any], dict[str, str]]:
    """The function of the preset in the options, or of the usual one; and its name."""
    presets = catalogue.presets_of(function)
    if not presets:
        return function, {}
    name = options.pop("preset", catalogue.usual_preset(function))
    catalogue.check_preset(presets, name)
    return presets[name], {"preset": name}


def _title(contract: Any) -> str:
    names = [kind.__name__ for kind in typing.get_args(contract) or (contract,)]
    return " or ".join(f"an {name}" if name[0] in "AEIO" else f"a {name}" for name in names)


def _sized(shape: tuple[int, ...]) -> str:
    return {0: "be one number", 1: f"be a list of {sum(shape)} numbers"}.get(len(shape), f"have shape {shape}")


def _declared(function: Callable[..., Any]) -> tuple[list[tuple[str, inspect.Parameter]], dict[str, Any]]:
    """Options of a function, and their annotations."""
    return list(inspect.signature(function).parameters.items()), typing.get_type_hints(function)


_declared_once = functools.cache(_declared)  # for thousands of trials; methods belong to short-lived parts


def _made(make: Callable[[], Any]) -> Any:
    """Result of `make`; any exception is about the options, which are its only input."""
    try:
        return make()
    except BadInput:
        raise
    except RAISED as error:
        fault = fault_of(error)
        raise BadInput("", "", fault.says, hint=fault.hint) from error


def inner_default(name: str, parameter: inspect.Parameter) -> Any:
    """Default part of an argument of INNER; None for no part."""
    return INNER[name][1] if parameter.default is inspect.Parameter.empty else parameter.default


def _inner(name: str, description: Any, folder: Path | None) -> tuple[Any, dict[str, Any] | list[dict[str, Any]]]:
    kind, default = INNER[name]
    if isinstance(default, tuple):
        if not isinstance(description, list | tuple):
            raise BadInput(name, "be a list of parts", description)
        pairs = [_at(f"{name}[{i}]", kind, {}, entry, folder) for i, entry in enumerate(description)]
        return [part for part, _ in pairs], [resolved for _, resolved in pairs]
    return _at(name, kind, {"kind": default}, description, folder)


def _law_of_each(
    description: Any, leading_arguments: tuple[Any, ...], folder: Path, context: Mapping[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """The described law for each subsystem of the given model, and its description with every default filled in."""
    if not isinstance(description, str | Mapping):
        raise BadInput(_LAW, "be a controller by name, or a mapping with `kind`", description)
    described_laws, before = [], 0
    for part in parts_of(leading_arguments[0])[0]:
        after = before + len(part.coordinates.angles)
        part_context = {key: value[before:after] if np.ndim(value) else value for key, value in context.items()}
        with error_location(_LAW):
            described_laws.append(make("controllers", description, folder, (part,), part_context))
        before = after
    # What differs between the subsystems follows from the rest of the scenario each time that it is built.
    law_options = {"kind": description} if isinstance(description, str) else description
    per_axis = {key for key, value in context.items() if np.ndim(value) and key not in law_options}
    resolved = {key: value for key, value in described_laws[0][1].items() if key not in per_axis}
    return tuple(law for law, _ in described_laws), resolved


def _at(
    name: str, kind: str, default: Mapping[str, str], description: Any, folder: Path | None
) -> tuple[Any, dict[str, Any]]:
    """The part at a key."""
    if isinstance(description, Mapping):
        description = {**default, **description}
    elif not isinstance(description, str):
        raise BadInput(name, "be a name, or a mapping with `kind` and options", description)
    with error_location(name):
        return make(kind, description, folder or Path())


def _samples(
    options: dict[str, Any], folder: Path, argument: str, rows_of_log: Callable[[Log], np.ndarray] | None
) -> dict[str, Any]:
    """Turn `file` (a CSV file) or `csv` (its text, as results keep it) into samples; returns what results keep.

    Args:
        options: of the part, which are changed.
        folder: folder of relative file names.
        argument: of the part that takes the samples.
        rows_of_log: rows of a log, for a part whose `file` is one, with a `mapping` if need be; None for others.
    """
    sources = [key for key in ("file", "csv", argument) if key in options]
    if len(sources) > 1:
        must = "be left out when there is another source of samples"
        raise BadInput(sources[1], must, f"given together with `{sources[0]}`")
    for key in ("file", "csv"):
        if key in options and not isinstance(options[key], str):
            raise BadInput(key, "be text", repr(options[key]))
    if "file" in options:
        name = options.pop("file")
        if rows_of_log is None:
            options["csv"] = read_csv(folder / name)
        else:
            with error_location(written=lambda key: "file" if key == "log" else key):
                options["csv"] = csv_of(rows_of_log(read_log(name, options.pop("mapping", None), folder)))
    else:
        name = "csv"
    if "csv" not in options:
        return {}
    text = options.pop("csv")
    options[argument] = samples_of(text, Path(name).name)
    return {"csv": text}


def listed(value: Any) -> Any:
    """A value as a scenario has it: tuples as lists."""
    return [listed(entry) for entry in value] if isinstance(value, tuple) else value


def portable_name(name: str, folder: Path) -> str:
    """A part by a name that is the same in every folder: one of a file gets its whole path."""
    if not catalogue.is_user_code(name):
        return name
    return whole_name(name, folder)


def whole_name(name: str, folder: Path) -> str:
    """The name of a file, or of a function in one, with its whole path."""
    path, mark, attribute = name.rpartition(":") if catalogue.is_user_code(name) else (name, "", "")
    return f"{(folder / path).resolve()}{mark}{attribute}"
