"""Descriptions of parts without running them, for `undertow list`, `undertow describe` and the docs."""

import inspect
import re
import typing
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.core.param import Parameter, parameters
from undertow.core.signals import Signal
from undertow.physics.plants.double_integrator import double_integrator
from undertow.scenario import factory
from undertow.scenario.vehicle_file import is_vehicle_file, read_vehicle


class Option(NamedTuple):
    """One option of a part, as written in a scenario."""

    name: str
    default: Any  # "required" when there is none
    meaning: str


class Description(NamedTuple):
    """A part, described."""

    kind: str
    name: str
    summary: str
    options: tuple[Option, ...]
    parameters: tuple[Parameter, ...]
    advice: tuple[str, ...]
    signals: dict[str, Signal]  # that it records
    preset: str = ""  # of the part, where it has several

    @property
    def title(self) -> str:
        """Its name, or that of the preset and of its part."""
        return f"{self.preset}, preset of {self.name}" if self.preset else self.name


# Arguments that come from the rest of a scenario, not from the user, by kind.
_GIVEN = {"controllers": ("model",), "supervision": ("law", "plant")}


def describe(name: str) -> tuple[Description, ...]:
    """All parts of a name; several kinds can have a part of the same name.

    Args:
        name: of a part, `kind/name` for one kind only, `./file.py:function`, or a vehicle file.

    Raises:
        BadInput: no such part.
    """
    if is_vehicle_file(name):
        vehicle_file = read_vehicle(Path(name), what="")
        described = tuple(parameters(vehicle_file.vehicle()))
        return (Description("vehicle file", name, vehicle_file.data.name, (), described, (), {}),)
    if catalogue.is_user_code(name):
        part = catalogue.find("", name, what="NAME")
        return (_describe("controllers" if factory.takes_model(part) else "", name, part),)
    prefix, _, short = name.rpartition("/")
    kinds = [kind for kind in catalogue.KINDS if prefix in ("", kind)]
    parts_by_kind = {kind: catalogue.names(kind) for kind in kinds}
    matches = [(kind, catalogue.presets(kind).get(short, short)) for kind in kinds]
    matches = [(kind, part) for kind, part in matches if part in parts_by_kind[kind]]
    descriptions = tuple(
        description for kind, part in matches for description in _presets(kind, part, parts_by_kind[kind][part], short)
    )
    if not descriptions:
        part_names = {name for kind in kinds for name in (*parts_by_kind[kind], *catalogue.presets(kind))}
        raise BadInput(
            "NAME",
            "be a part",
            name,
            hint=did_you_mean(short, {*part_names, "scenario", "campaign", "metrics", "signals"}),
        )
    return descriptions


def summary(part: Any) -> str:
    """First sentence of a part's docstring."""
    return (inspect.getdoc(part) or "").split("\n\n")[0].replace("\n", " ")


def listed(kind: str) -> list[tuple[str, str]]:
    """Names of the parts of a kind and of their presets, each with a sentence, in alphabetical order."""
    parts = catalogue.names(kind)
    rows = [(name, summary(part)) for name, part in parts.items()]
    for preset, name in catalogue.presets(kind).items():
        sentence = summary(catalogue.presets_of(parts[name])[preset])
        begin = sentence[:1] if sentence[1:2].isupper() else sentence[:1].lower()
        rows.append((preset, f"Preset of `{name}`: {begin}{sentence[1:]}"))
    return sorted(rows)


def _presets(kind: str, name: str, part: Any, short: str) -> tuple[Description, ...]:
    """The part, or each of its presets, or the one of the name `short`."""
    presets = catalogue.presets_of(part)
    if not presets:
        return (_describe(kind, name, part),)
    descriptions = []
    for preset, function in presets.items():
        if short not in (name, preset):
            continue
        description = _describe(kind, name, function, {"kind": name, "preset": preset})
        usual = catalogue.usual_preset(part) or "required"
        preset_option = Option("preset", usual, f"one of {', '.join(presets)}; these are the options of {preset}.")
        descriptions.append(description._replace(preset=preset, options=(preset_option, *description.options)))
    return tuple(descriptions)


def _describe(kind: str, name: str, part: Any, description: Any = None) -> Description:
    instance = _instance(kind, description or name, part)
    described: Any = instance if instance is not None else typing.get_type_hints(part).get("return")
    has_parameters = isinstance(described, eqx.Module) or (
        isinstance(described, type) and issubclass(described, eqx.Module)
    )
    advise = getattr(instance, "advice", tuple)
    return Description(
        kind=kind,
        name=name,
        summary=_prose(part),
        options=options_of(kind, part),
        parameters=tuple(map(_depending, parameters(described))) if has_parameters else (),
        advice=advise(),
        signals=_signals(kind, description or name, instance),
    )


def _depending(parameter: Parameter) -> Parameter:
    """A parameter of a class, which a part computes from its options."""
    return parameter._replace(value="by the options") if parameter.value == "required" else parameter


def _instance(kind: str, name: Any, part: Any) -> Any:
    """The part with all its defaults; None where it has required options."""
    try:
        return factory.make(kind, name, Path())[0] if kind else part()
    except Exception:
        return None


def _signals(kind: str, name: Any, instance: Any) -> dict[str, Signal]:
    """What the part records beside what every run does; of a law, as it is made for one axis."""
    if kind == "controllers":
        try:
            instance = factory.make(kind, name, Path(), (double_integrator().model(),))[0]
        except Exception:
            return {}
    return getattr(instance, "signals", dict)()


def _prose(part: Any) -> str:
    """Docstring without its sections."""
    return re.split(r"\n\s*(?:Args|Raises|Returns):", inspect.getdoc(part) or "")[0].strip()


def options_of(kind: str, part: Any) -> tuple[Option, ...]:
    """Options of a part, from the signature and docstring of its function."""
    meanings = _meanings(inspect.getdoc(part) or "")
    options = []
    for name, parameter in inspect.signature(part).parameters.items():
        default = "required" if parameter.default is inspect.Parameter.empty else parameter.default
        if name in factory.INNER:
            default = factory.inner_default(name, parameter)
        if name not in _GIVEN.get(kind, ()):
            options.append(Option(name, default, meanings.get(name, "")))
    return tuple(options)


def _meanings(text: str) -> dict[str, str]:
    """Argument -> its text in the `Args:` section of a docstring; `a, b: ...` describes both."""
    section = re.search(r"^Args:\n((?:[ \t]+.*\n?|\n)*)", text, re.MULTILINE)
    meanings: dict[str, str] = {}
    names: list[str] = []
    for line in (section.group(1) if section else "").splitlines():
        entry = re.match(r"^ {4}(\w+(?:, \w+)*): (.*)$", line)
        names = entry.group(1).split(", ") if entry else names
        more = entry.group(2) if entry else line.strip()
        for name in names:
            meanings[name] = f"{meanings.get(name, '')} {more}".strip()
    return meanings


def text_of(value: Any) -> str:
    """A short text for the value of an option, a parameter or a key; a diagonal matrix is shown as its diagonal."""
    if isinstance(value, str) or value is None or (isinstance(value, list | dict) and not value):
        return value if isinstance(value, str) else "none"
    if isinstance(value, bool) or not isinstance(value, int | float | list | tuple):
        return str(value).lower()
    if isinstance(value, list | tuple) and any(isinstance(entry, str) for entry in value):
        return ", ".join(value)
    array = np.asarray(value, dtype=float)
    if array.ndim == 0:
        return f"{array:.6g}"
    if array.ndim == 2 and array.shape[0] == array.shape[1] and not np.any(array - np.diag(np.diag(array))):
        return f"diag{_row(np.diag(array))}"
    return "\n".join(map(_row, np.atleast_2d(array)))


def _row(entries: np.ndarray) -> str:
    return f"({', '.join(f'{entry:.6g}' for entry in entries)})"
