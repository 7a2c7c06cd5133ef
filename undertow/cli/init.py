"""`undertow init`: write a commented scenario to start from, and the files that it names."""

import contextlib
import json
import shlex
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.json_schema import scenario_schema

_SCHEMA, _VEHICLE, _CONTROLLER = "scenario.schema.json", "my_rov.yaml", "my_controller.py"

# Vehicles that can keep a position, with a thruster each. The others have one propeller, which moves them forward only.
_THRUSTERS = {
    "bluerov2": "{kind: t200, fidelity: shaft, supply: 16}  # V",
    "bluerov2_heavy": "{kind: t200, fidelity: shaft, supply: 16}  # V",
    "odin": "{kind: paper_table3, fidelity: shaft}",
    "rexrov": "{kind: commanded_thrust, thrust_forward_max: 1500, thrust_reverse_max: 1500}  # N",
}
_DEFAULT = "bluerov2_heavy"  # of the template


def init(path: Path, vehicle: str | None, own_vehicle: bool, own_controller: bool) -> None:
    """Write a scenario, its JSON schema for editors, and the files of own parts. No file is replaced.

    Args:
        path: folder, in which the scenario is called scenario.yaml; or the name of the scenario, ending in .yaml.
        vehicle: of the catalogue; None for bluerov2_heavy.
        own_vehicle: whether to write a vehicle file too, which the scenario names.
        own_controller: whether to write a Python file with a controller too, which the scenario names.

    Raises:
        BadInput: options that do not go together, or a file of such a name is there.
        OSError: the files cannot be written; none of them is left.
    """
    scenario = path if path.suffix in (".yaml", ".yml") else path / "scenario.yaml"
    folder = scenario.parent
    contents = {scenario.name: _scenario(scenario.name, vehicle, own_vehicle, own_controller)}
    contents |= {_VEHICLE: _template(_VEHICLE)} if own_vehicle else {}
    contents |= {_CONTROLLER: _template(_CONTROLLER)} if own_controller else {}
    _check_free(folder, contents)
    if not (folder / _SCHEMA).exists():  # an earlier scenario brought it
        contents[_SCHEMA] = json.dumps(scenario_schema(), indent=1) + "\n"
    _write(folder, contents)
    print(f"Wrote {', '.join(str(folder / name) for name in contents)}")
    inside = "" if folder.resolve() == Path().resolve() else f"cd {shlex.quote(str(folder))} && "
    name = shlex.quote(scenario.name)
    print(f"Next: {inside}undertow check {name} && undertow simulate {name}")


def _scenario(name: str, vehicle: str | None, own_vehicle: bool, own_controller: bool) -> str:
    """The template with the chosen parts in place of its own."""
    if own_vehicle and vehicle is not None:
        raise BadInput("--vehicle", "be left out with --own-vehicle", vehicle)
    if vehicle is not None and vehicle not in _THRUSTERS:
        hint = f"{did_you_mean(vehicle, _THRUSTERS)}. For another vehicle, change `plant` of the file"
        raise BadInput("--vehicle", "be a vehicle of the catalogue with more than one thruster", vehicle, hint=hint)
    text = _template("scenario.yaml")
    chosen = {"undertow check scenario.yaml": f"undertow check {name}"}
    chosen["undertow simulate scenario.yaml"] = f"undertow simulate {name}"
    chosen[f"vehicle: {_DEFAULT}"] = f"vehicle: {_VEHICLE if own_vehicle else vehicle or _DEFAULT}"
    chosen[f"thruster: {_THRUSTERS[_DEFAULT]}"] = f"thruster: {_THRUSTERS[vehicle or _DEFAULT]}"
    if own_controller:
        line = next(line for line in text.splitlines() if line.startswith("  kind: pid"))
        stem = _CONTROLLER.removesuffix(".py")
        chosen[line] = (
            f"  kind: ./{_CONTROLLER}:{stem}\n  slope: 2                         # 1/s, an option of the function"
        )
    for old, new in chosen.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def _template(name: str) -> str:
    return files("undertow.scenario").joinpath("templates", name).read_text(encoding="utf-8")


def _check_free(folder: Path, names: Mapping[str, str]) -> None:
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise BadInput("PATH", "be a folder, or a file that ends in .yaml", f"{part}, another file")
    taken = [str(folder / name) for name in names if (folder / name).exists()]
    if taken:
        hint = "Nothing was written. Name another folder or scenario, for example `undertow init my_study`"
        raise BadInput("PATH", "be a place without these files", f"one that has {', '.join(taken)}", hint=hint)


def _write(folder: Path, contents: Mapping[str, str]) -> None:
    """All files, or none of them."""
    written: list[Path] = []
    made = [part for part in (folder, *folder.parents) if not part.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in contents.items():
            with (folder / name).open("x", encoding="utf-8") as file:
                written.append(folder / name)
                file.write(text)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        for part in made:
            with contextlib.suppress(OSError):
                part.rmdir()
        raise
