"""Catalogue of parts: each vehicle, thruster, plant, controller, ... is one file, and there is no list of them.

A module of a part folder whose name is also the name of a callable inside it is a part: `vehicles/odin.py`
with `def odin()`. Other parts are named `./my_rov.py:my_rov`, or come as Python entry points of the group
`undertow.<kind>`.
"""

import ast
import functools
import importlib
import importlib.metadata
import importlib.util
import pkgutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from undertow.core.errors import BadInput, did_you_mean
from undertow.core.runtime import double_outside_runs
from undertow.core.user_code import MODULE_PREFIX, python_says

KINDS = (
    "vehicles",
    "thrusters",
    "power",
    "plants",
    "controllers",
    "disturbances",
    "references",
    "sensors",
    "navigation",
)

# Key of a scenario -> kind of its part.
KIND_OF = {"plant": "plants", "controller": "controllers", "reference": "references"}
KIND_OF |= {"disturbance": "disturbances", "navigation": "navigation", "metrics": "metrics"}

# Kind of a part -> where it stands in a scenario.
KEY_OF = {kind: key for key, kind in KIND_OF.items()}
KEY_OF |= {"vehicles": "plant.vehicle", "thrusters": "plant.thruster", "power": "plant.battery` or `plant.esc"}
KEY_OF |= {"sensors": "navigation.sensors` of `kind: observer"}

Part = Callable[..., Any]


@functools.cache
def collect(package: ModuleType) -> dict[str, Part]:
    """Parts that the modules of a package define, by name; outside of a run they are made in double precision."""
    parts = {}
    for info in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{info.name}")
        part = getattr(module, info.name, None)
        if callable(part):
            parts[info.name] = double_outside_runs(part)
            setattr(module, info.name, parts[info.name])
    return parts


def publish(package_name: str) -> Callable[[str], Any]:
    """Make every part an attribute of its package; returns the package's `__getattr__`."""
    package = importlib.import_module(package_name)
    parts = collect(package)
    vars(package).update(parts)

    def missing(name: str) -> Any:
        raise AttributeError(f"{package_name} has no part `{name}`. {did_you_mean(name, parts)}")

    return missing


def names(kind: str) -> dict[str, Part]:
    """All parts of a kind: shipped ones and those of installed entry points."""
    parts = collect(importlib.import_module(f"undertow.{kind}")) if kind in KINDS else {}
    return parts | {entry.name: entry.load() for entry in _entry_points(f"undertow.{kind}")}


@functools.cache
def _entry_points(group: str) -> tuple[importlib.metadata.EntryPoint, ...]:
    # Cached, because it reads a file of every installed package: too slow for each trial of a campaign.
    return tuple(importlib.metadata.entry_points(group=group))


def find(kind: str, name: str, folder: Path | None = None, what: str = "name") -> Part:
    """Part called `name`, or the callable named by `path.py:callable` (relative to `folder`).

    Args:
        kind: folder of the catalogue.
        name: of the part, or of a callable in a file.
        folder: where the file's name starts.
        what: the argument or key that gives the name, for messages.

    Raises:
        BadInput: no such part, file or callable.
    """
    if ".py:" in name:
        return _from_file(name, folder or Path(), what)
    if name.endswith(".py"):
        hint = f"Add its name: {name}:{(_functions_in((folder or Path()) / name) or ['function'])[0]}"
        raise BadInput(what, "name a file and a function in it", name, hint=hint)
    parts = names(kind)
    if name not in parts:
        hint = did_you_mean(name, parts) if parts else "Name a file of your own: ./file.py:function"
        other = next((one for one in KINDS if one != kind and name in names(one)), None) if parts else None
        hint = f"`{name}` is one of the {other}: give it at `{KEY_OF[other]}`" if other else hint
        if kind == "plants" and name.endswith((".yaml", ".yml")):
            hint = f"A vehicle file is named as `plant: {{vehicle: {name}}}`"
        raise BadInput(what, f"be a part in {kind}", name, hint=hint)
    return parts[name]


@functools.lru_cache
def _module(path: Path, contents: bytes) -> ModuleType:
    """A file as a module, loaded once per content, so that two parts from it have the same class."""
    spec = importlib.util.spec_from_file_location(f"{MODULE_PREFIX}{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ImportError("not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where annotations of the file are looked up
    spec.loader.exec_module(module)
    return module


def _from_file(name: str, folder: Path, what: str) -> Part:
    path_text, attribute = name.rsplit(":", 1)
    path = (folder / path_text).resolve()
    if not path.is_file():
        raise BadInput(what, "name an existing file", path_text)
    try:
        module = _module(path, path.read_bytes())
    except (Exception, SystemExit) as error:
        raise BadInput(what, "name a file that Python can run", f"{path_text}: {python_says(error)}") from error
    part = getattr(module, attribute, None)
    if not callable(part):
        hint = did_you_mean(attribute, _functions_in(path))
        raise BadInput(what, f"name a function in {path.name}", attribute or "empty", hint=hint)
    return part


def _functions_in(path: Path) -> list[str]:
    """Names of the functions and classes that a file defines, without running it; [] where it cannot be read."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return []
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]
