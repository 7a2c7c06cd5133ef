"""Catalogue of parts: each vehicle, thruster, plant, controller, ... is one file, and there is no list of them.

A module of a part folder whose name is also the name of a callable inside it is a part: `vehicles/odin.py` with `def
odin()`. A module with several small parts names them in `PARTS`. Other parts are named `./my_rov.py:my_rov`, or come
as Python entry points of the group `undertow.<kind>`.
"""

import ast
import functools
import importlib
import importlib.metadata
import importlib.util
import inspect
import pkgutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from undertow.core import checks
from undertow.core.contracts import Model
from undertow.core.errors import BadInput, did_you_mean
from undertow.core.part_packages import PACKAGE_OF
from undertow.core.runtime import double_outside_runs
from undertow.core.user_code import MODULE_PREFIX, fault_of

KINDS = tuple(PACKAGE_OF)

# Key of a scenario -> kind of its part.
KIND_OF = {"plant": "plants", "controller": "controllers", "reference": "references"}
KIND_OF |= {"disturbance": "disturbances", "navigation": "navigation", "metrics": "metrics"}
KIND_OF |= {"supervisor": "supervision"}

# Kind of a part -> where it stands in a scenario.
KEY_OF = {kind: key for key, kind in KIND_OF.items()}
KEY_OF |= {"vehicles": "plant.vehicle", "thrusters": "plant.thruster", "power": "plant.battery` or `plant.esc"}
KEY_OF |= {"sensors": "navigation.sensors` of `kind: kalman", "faults": "mode` of an entry of `faults"}

# What others call a part -> its name here.
_OTHER_WORDS = {"gps": "position_fix", "gnss": "position_fix", "usbl": "position_fix", "lbl": "position_fix"}
_OTHER_WORDS |= {"magnetometer": "compass", "heading": "compass", "ahrs": "imu", "gyro": "imu", "accelerometer": "imu"}
_OTHER_WORDS |= {"pressure": "depth", "barometer": "depth", "tachometer": "propeller_speed", "rpm": "propeller_speed"}
_OTHER_WORDS |= {"step": "setpoint", "hover": "setpoint", "station_keeping": "setpoint", "lawnmower": "lawn_mower"}
_OTHER_WORDS |= dict.fromkeys(("dead", "failed", "failure", "broken", "lost"), "off")
_OTHER_WORDS |= {"wave": "waves", "ocean_current": "current", "cable": "tether", "noise": "white_noise"}

Part = Callable[..., Any]

# In the annotation of an option, `Annotated[str, FILE]`: it names a file, relative to the folder of the scenario.
FILE = "file"


class PartPackage(ModuleType):
    """A package whose attributes are its parts and their presets, where Python would put modules of the same names."""

    def __setattr__(self, name: str, value: Any) -> None:
        if isinstance(value, ModuleType) and value.__name__ == f"{self.__name__}.{name}":
            vars(self).update(_parts_in(value))
            if name in _parts_in(value) or hasattr(value, "__path__"):  # a folder may have the name of a preset
                return
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*vars(self), *collect(self), *_preset_parts(self)})


@functools.cache
def _parts_in(module: ModuleType) -> dict[str, Part]:
    """Parts that a module defines, by name; outside of a run they are made in double precision."""
    by_name = {part.__name__: part for part in getattr(module, "PARTS", ())}
    own_name = module.__name__.rpartition(".")[2]
    if callable(part := getattr(module, own_name, None)):
        by_name[own_name] = part
    parts = {name: double_outside_runs(_of_a_model(part)) for name, part in by_name.items()}
    vars(module).update(parts)
    return parts


@functools.cache
def _module_names(package: ModuleType) -> tuple[str, ...]:
    return tuple(info.name for info in pkgutil.iter_modules(package.__path__))


@functools.cache
def collect(package: ModuleType) -> dict[str, Part]:
    """Parts that the modules of a package define, by name, in the order of the modules."""
    modules = [importlib.import_module(f"{package.__name__}.{name}") for name in _module_names(package)]
    return {name: part for module in modules for name, part in _parts_in(module).items()}


def _shipped(kind: str, name: str) -> Part | None:
    """The part that has a file of its name; the other files are not loaded. None where there is none."""
    if kind not in PACKAGE_OF or name in {entry.name for entry in _entry_points(f"undertow.{kind}")}:
        return None
    package = importlib.import_module(PACKAGE_OF[kind])
    if name not in _module_names(package):
        return None
    return _parts_in(importlib.import_module(f"{package.__name__}.{name}")).get(name)


def _of_a_model(part: Part) -> Part:
    """A part that is made from a nominal model, with errors for a plant in its place and for unknown options.

    Any other part as it is.
    """
    parameters = inspect.signature(part).parameters
    if next(iter(parameters), "") != "model":
        return part
    takes_any = any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters.values())

    @functools.wraps(part)
    def made(model: Any = None, *arguments: Any, **options: Any) -> Any:
        if not isinstance(model, Model):
            hint = "Give it `plant.model()`"
            raise BadInput("model", "be the nominal model of a plant", f"of type {type(model).__name__}", hint=hint)
        if not takes_any:
            _check_options(part, options, f"`{part.__name__}`")
        return part(model, *arguments, **options)

    return made


def _check_options(part: Part, options: Mapping[str, Any], called: str) -> None:
    known = list(inspect.signature(part).parameters)[1:]
    for name in options:
        if name not in known:
            raise BadInput(name, f"be an option of {called}", "unknown", hint=did_you_mean(name, known))


def publish(package_name: str) -> Callable[[str], Any]:
    """Make parts and presets attributes of their package, loaded when first used; returns the package's `__getattr__`.

    In the `__init__` of a package, `WITH_PRESETS` names the parts that have presets, if any have.
    """
    package = sys.modules[package_name]
    package.__class__ = PartPackage
    for name, value in list(vars(package).items()):  # modules that its `__init__` has imported before
        setattr(package, name, value)

    def part(name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{package_name} has no `{name}`")
        if name in _module_names(package):
            module = importlib.import_module(f"{package_name}.{name}")
            of_that_name = _preset_parts(package) if hasattr(module, "__path__") else _parts_in(module)
            return of_that_name.get(name, module)
        parts = _preset_parts(package) | collect(package)
        if name not in parts:
            raise AttributeError(f"{package_name} has no part `{name}`. {did_you_mean(name, parts)}")
        return parts[name]

    return part


def names(kind: str) -> dict[str, Part]:
    """All parts of a kind: shipped ones and those of installed entry points."""
    parts = collect(importlib.import_module(PACKAGE_OF[kind])) if kind in PACKAGE_OF else {}
    return parts | _from_elsewhere(kind)


def _from_elsewhere(kind: str) -> dict[str, Part]:
    """Parts of other packages, by name."""
    return {entry.name: entry.load() for entry in _entry_points(f"undertow.{kind}")}


def presets_of(part: Part) -> Mapping[str, Part]:
    """Presets of a part, each with its own options; most parts have none."""
    return getattr(part, "presets", {})


def usual_preset(part: Part) -> str:
    """The preset that a part with presets has unless another is named; "" where one must be named."""
    return inspect.signature(part).parameters["preset"].default


def presets(kind: str) -> dict[str, str]:
    """Every preset of the parts of a kind, with the name of its part: `robust` is one of `rcaf`."""
    shipped = _with_presets(importlib.import_module(PACKAGE_OF[kind])) if kind in PACKAGE_OF else {}
    return {preset: name for name, part in (shipped | _from_elsewhere(kind)).items() for preset in presets_of(part)}


def _with_presets(package: ModuleType) -> dict[str, Part]:
    return {name: getattr(package, name) for name in vars(package).get("WITH_PRESETS", ())}


@functools.cache
def _preset_parts(package: ModuleType) -> dict[str, Part]:
    """The presets of the parts of a package, by name."""
    of_parts = (presets_of(part) for part in _with_presets(package).values())
    return {name: double_outside_runs(_of_a_model(part)) for presets in of_parts for name, part in presets.items()}


def by_preset(presets: Mapping[str, Part], preset: str, model: Any, options: Mapping[str, Any]) -> Any:
    """A law of several presets: what the chosen one makes of a model and its options.

    Raises:
        BadInput: there is no such preset, or it has no such option.
    """
    check_preset(presets, preset)
    _check_options(presets[preset], options, f"preset `{preset}`")
    return presets[preset](model, **options)


def check_preset(presets: Mapping[str, Part], preset: Any) -> None:
    """Check that there is such a preset; with "" none was given to a part that has no usual one.

    Raises:
        BadInput: there is none.
    """
    if preset == "":
        raise BadInput("preset", "be given", hint=f"It is one of {', '.join(presets)}")
    checks.choice("preset", preset, tuple(presets))


def spelled_out(kind: str, description: Mapping[str, Any]) -> dict[str, Any]:
    """A part that is named by a preset, as the part with that preset: `robust` is `{kind: rcaf, preset: robust}`.

    Raises:
        BadInput: it has a preset besides.
    """
    name = description.get("kind")
    part = presets(kind).get(name) if isinstance(name, str) else None
    if part is None:
        return dict(description)
    if "preset" in description:
        raise BadInput("preset", f"be left out, because `{name}` is a preset of `{part}`", description["preset"])
    return {**description, "kind": part, "preset": name}


@functools.cache
def _all_entry_points() -> Any:
    # Cached, because it reads a file of every installed package: too slow for each trial of a campaign.
    return importlib.metadata.entry_points()


def _entry_points(group: str) -> tuple[importlib.metadata.EntryPoint, ...]:
    return tuple(_all_entry_points().select(group=group))


def is_user_code(name: str) -> bool:
    """Whether a part is named as a function in a file of the user's, `./file.py:function`."""
    return ".py:" in name


def find(kind: str, name: str, folder: Path | None = None, what: str = "name") -> Part:
    """Part called `name`, or the callable named by `path.py:callable` (relative to `folder`).

    Args:
        kind: folder of the catalogue.
        name: of the part, or of a callable in a file.
        folder: where the file's name starts.
        what: the key that gives the name, for messages, or the name itself where it is an argument.

    Raises:
        BadInput: no such part, file or callable.
    """
    if is_user_code(name):
        return _from_file(name, folder or Path(), what)
    if name.endswith(".py"):
        hint = maker_in((folder or Path()) / name, name)
        raise BadInput(what, "name a file and a function in it", "a file alone" if what == name else name, hint=hint)
    part = _shipped(kind, name)
    if part is not None:
        return part
    parts = names(kind)
    if name not in parts:
        hint = did_you_mean(name, [*presets(kind), *parts]) if parts else "Name a file of your own: ./file.py:function"
        kinds_with_it = (part_kind for part_kind in KINDS if part_kind != kind and name in names(part_kind))
        other_kind = next(kinds_with_it, None) if parts else None
        hint = f"`{name}` is one of the {other_kind}: give it at `{KEY_OF[other_kind]}`" if other_kind else hint
        hint = f"Did you mean `{_OTHER_WORDS[name.lower()]}`?" if _OTHER_WORDS.get(name.lower()) in parts else hint
        if kind == "plants" and name.endswith((".yaml", ".yml")):
            hint = f"A vehicle file is named as `plant: {{vehicle: {name}}}`"
        raise BadInput(what, f"be a part in {kind}", name, hint=hint)
    return parts[name]


@functools.lru_cache
def _module(path: Path, contents: bytes) -> ModuleType:
    """A file as a module, loaded once per content, so that two parts from it have the same class.

    What runs are these bytes: Python's loader would read the file once more, or compiled code that lies beside it.
    """
    spec = importlib.util.spec_from_file_location(f"{MODULE_PREFIX}{path.stem}", path)
    if spec is None:
        raise ImportError("not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where annotations of the file are looked up
    exec(compile(contents, str(path), "exec"), vars(module))
    return module


def _from_file(name: str, folder: Path, what: str) -> Part:
    path_text, attribute = name.rsplit(":", 1)
    path = (folder / path_text).resolve()
    if not path.is_file():
        if what == name:
            raise BadInput(path_text, "be an existing file", "not")
        raise BadInput(what, "name an existing file", path_text)
    try:
        module = _module(path, path.read_bytes())
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        fault = fault_of(error)
        message = f"{'' if fault.says.startswith('cannot') else 'Python cannot run it: '}{fault.says}"
        raise BadInput(what, "", message, hint=fault.hint) from error
    part = getattr(module, attribute, None)
    if not callable(part):
        functions, classes = _defined_in(path)
        hint = did_you_mean(attribute, functions or classes) if functions or classes else ""
        raise BadInput(what, f"name a function in {path.name}", attribute or "empty", hint=hint)
    return part


def maker_in(file: Path, name: str) -> str:
    """How to name a function of a user's file that makes a part, where a class or nothing was named.

    Args:
        file: the file.
        name: of the file, as the user wrote it.
    """
    functions, _ = _defined_in(file)
    if not functions:
        return "Add a function that makes the part to the file; `undertow init --own-controller` writes an example"
    also = f"; others are {', '.join(functions[1:])}" if len(functions) > 1 else ""
    return f"Add its name: {name}:{functions[0]}{also}"


def _defined_in(path: Path) -> tuple[list[str], list[str]]:
    """Names of the functions and of the classes that a file defines, without running it; none if it cannot be read."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return [], []
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_")]
    return functions, classes
