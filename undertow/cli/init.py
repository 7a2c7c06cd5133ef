"""`undertow init`: write a commented scenario to start from, and the files that it names."""

import contextlib
import json
import os
import re
import shlex
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from undertow.cli.options.init import InitCommand
from undertow.core import catalogue
from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput, did_you_mean, joined
from undertow.scenario.json_schema import scenario_schema
from undertow.scenario.reading import nearest_file

_SCHEMA, _VEHICLE, _CONTROLLER = "scenario.schema.json", "my_rov.yaml", "my_controller.py"

# Vehicles that can keep a position, with a thruster each. The others have one propeller, which moves them forward only.
_THRUSTERS = {
    "bluerov2": "{kind: t200, fidelity: shaft, supply: 16}  # V",
    "bluerov2_heavy": "{kind: t200, fidelity: shaft, supply: 16}  # V",
    "odin": "{kind: paper_table3, fidelity: shaft}",
    "rexrov": "{kind: commanded_thrust, thrust_forward_max: 1500, thrust_reverse_max: 1500}  # N",
}
_DEFAULT = "bluerov2_heavy"  # of the template


def init(command: InitCommand) -> None:
    """Write a scenario, its JSON schema for editors, and the files of own parts. No file is replaced.

    Raises:
        BadInput: options that do not go together, or a file of such a name is there.
        OSError: the files cannot be written; none of them is left.
    """
    path, vehicle, controller = command.path, command.vehicle, command.controller
    scenario = path if path.suffix in (".yaml", ".yml") else path / "scenario.yaml"
    folder = scenario.parent
    if command.own_vehicle and vehicle is not None:
        raise BadInput("--vehicle", "be left out with --own-vehicle", vehicle)
    if command.own_controller and controller is not None:
        raise BadInput("--controller", "be left out with --own-controller", controller)
    law = f"./{_CONTROLLER}:{_CONTROLLER.removesuffix('.py')}" if command.own_controller else _law(controller, folder)
    body = _VEHICLE if command.own_vehicle else _body(vehicle or _DEFAULT, folder)
    contents = {scenario.name: _scenario(scenario.name, body, _THRUSTERS.get(body, _THRUSTERS[_DEFAULT]), law)}
    contents |= {_VEHICLE: _template(_VEHICLE)} if command.own_vehicle else {}
    contents |= {_CONTROLLER: _template(_CONTROLLER)} if command.own_controller else {}
    _check_free(folder, contents)
    if not (folder / _SCHEMA).exists():  # an earlier scenario brought it
        contents[_SCHEMA] = json.dumps(scenario_schema(), indent=1) + "\n"
    _write(folder, contents)
    print(f"Wrote {', '.join(str(folder / name) for name in contents)}")
    inside = "" if folder.resolve() == Path().resolve() else f"cd {shlex.quote(str(folder))} && "
    name = shlex.quote(scenario.name)
    print(f"Next: {inside}undertow check {name} && undertow simulate {name}")


def _body(vehicle: str, folder: Path) -> str:
    """The vehicle as a scenario in the folder names it."""
    if vehicle.endswith((".yaml", ".yml")):
        if not Path(vehicle).is_file():
            hint = "`undertow init --own-vehicle` writes one to fill in"
            raise BadInput("--vehicle", "be a vehicle file that is there", vehicle, hint=hint)
        return _quoted(_from_folder(vehicle, folder))
    if vehicle not in _THRUSTERS:
        known = nearest_file(Path(vehicle)) or did_you_mean(vehicle, _THRUSTERS)
        hint = joined(known, "For another vehicle, change `plant` of the file")
        must = "be a vehicle of the catalogue with more than one thruster, or a vehicle file"
        raise BadInput("--vehicle", must, vehicle, hint=hint)
    return vehicle


def _law(controller: str | None, folder: Path) -> str | None:
    """The controller as a scenario in the folder names it; None for that of the template."""
    if controller is None:
        return None
    if ".py" not in controller:
        hint = "For a controller of the catalogue, change `controller` of the file"
        raise BadInput("--controller", "be FILE.py:FUNCTION", controller, hint=hint)
    catalogue.find("controllers", controller, Path(), "--controller")
    file, _, function = controller.rpartition(":")
    relative_path = _from_folder(file, folder)
    return _quoted(f"{relative_path if relative_path.startswith('..') else f'./{relative_path}'}:{function}")


def _from_folder(file: str, folder: Path) -> str:
    return Path(os.path.relpath(file, folder)).as_posix()


def _quoted(text: str) -> str:
    """A text as it stands in YAML."""
    return text if re.fullmatch(r"[\w./:-]+", text) else json.dumps(text)


def _scenario(name: str, vehicle: str, thruster: str, controller: str | None) -> str:
    """The template with the chosen parts in place of its own."""
    text = _template("scenario.yaml")
    replacements = {"undertow check scenario.yaml": f"undertow check {name}"}
    replacements["undertow simulate scenario.yaml"] = f"undertow simulate {name}"
    replacements[f"vehicle: {_DEFAULT}"] = f"vehicle: {vehicle}"
    replacements[f"thruster: {_THRUSTERS[_DEFAULT]}"] = f"thruster: {thruster}"
    if controller is not None:
        line = next(line for line in text.splitlines() if line.startswith("  kind: pid"))
        replacements[line] = f"  kind: {controller}"
        if controller == f"./{_CONTROLLER}:{_CONTROLLER.removesuffix('.py')}":
            replacements[line] += "\n  slope: 2                         # 1/s, an option of the function"
    for old, new in replacements.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def _template(name: str) -> str:
    return files("undertow.scenario").joinpath("templates", name).read_text(encoding="utf-8")


def _check_free(folder: Path, names: Mapping[str, str]) -> None:
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise BadInput("PATH", "be a folder, or a file that ends in .yaml", f"{part}, another file")
    existing = [str(folder / name) for name in names if (folder / name).exists()]
    if existing:
        hint = "Nothing was written. Name another folder or scenario, for example `undertow init my_study`"
        raise BadInput("PATH", "be a place without these files", f"one that has {', '.join(existing)}", hint=hint)


def _write(folder: Path, contents: Mapping[str, str]) -> None:
    """All files, or none of them."""
    written: list[Path] = []
    new_folders = [part for part in (folder, *folder.parents) if not part.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in contents.items():
            written.append(folder / name)
            write_whole(folder / name, text)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        for part in new_folders:
            with contextlib.suppress(OSError):
                part.rmdir()
        raise
