"""A vehicle from a YAML file. See docs/how-to/your-own-vehicle.md."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput, error_location
from undertow.core.runtime import double_outside_runs
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario.reading import Text, from_data, key_path, read, wrong_file
from undertow.scenario.validation import kind_of
from undertow.scenario.values import checked
from undertow.scenario.vehicle_parameters import check_name, is_outside, with_parameters
from undertow.scenario.vehicle_schema import INSTEAD, VehicleData, parse
from undertow.scenario.vehicle_uncertainty import SECTION, VehicleUncertainty, uncertainty_of, without_deviations

_VALUES = "values"  # key beside those of a vehicle file: other values of its parameters, by name
_FROM = {"weight": "mass", "buoyancy": "volume"}  # where the key itself is not given


class VehicleFile(NamedTuple):
    """A vehicle file as read, some of its keys perhaps changed."""

    data: VehicleData
    contents: dict[str, Any]  # plain data that make the same vehicle again; all deviations are in `uncertainty`
    text: Text
    changed: frozenset[str]  # keys that are no longer the file's
    uncertainty: VehicleUncertainty | None  # of its numbers; None where the file has no deviations

    def location(self, name: str) -> str:
        """Location of a key in the file, also of one that is changed."""
        return _location(self.text, frozenset())(name)

    @double_outside_runs
    def vehicle(self) -> VehicleModel:
        """The vehicle.

        Raises:
            BadInput: numbers that cannot be a vehicle's, with their place in the file.
        """
        with error_location(location=_location(self.text, self.changed)):
            return self.data.vehicle()


def is_vehicle_file(name: str) -> bool:
    """Whether the name of a part is that of a vehicle file."""
    return Path(name).suffix in (".yaml", ".yml")


def vehicle_file_of(scenario: Text) -> VehicleFile | None:
    """The vehicle file of a scenario; None where its vehicle is one of the catalogue.

    Raises:
        BadInput: the file cannot be read.
    """
    plant = scenario.data.get("plant")
    description = plant.get("vehicle") if isinstance(plant, Mapping) else None
    if not isinstance(description, str | Mapping):
        return None
    options = {"kind": description} if isinstance(description, str) else dict(description)
    kind = str(options.pop("kind", ""))
    return read_vehicle(scenario.folder / kind, options, "plant.vehicle.kind") if is_vehicle_file(kind) else None


def has_deviations(scenario: Text) -> bool:
    """Whether a scenario has a vehicle file whose numbers have deviations."""
    vehicle_file = vehicle_file_of(scenario)
    return vehicle_file is not None and vehicle_file.uncertainty is not None


def read_vehicle(path: Path, changes: Mapping[str, Any] | None = None, what: str = "kind") -> VehicleFile:
    """A vehicle file, read and checked for form.

    Args:
        path: of the file.
        changes: other values for some of its keys, as if they stood there; `values`, others of its parameters, by the
            names of `vehicle_parameters`; or `contents`, the whole of it, and the file need not exist.
        what: the key that names the file, for messages; "" for an argument.

    Raises:
        BadInput: anything wrong, with the line in the file unless it is among the changes.
    """
    changes = dict(changes or {})
    stored_contents = changes.pop("contents", None)
    values = _flat(_VALUES, changes.pop(_VALUES, {}))
    if stored_contents is not None and not isinstance(stored_contents, Mapping):
        raise BadInput("contents", "be a mapping, as in a vehicle file", stored_contents)
    text = read(path, what) if stored_contents is None else from_data(stored_contents)
    if stored_contents is None and (kind := kind_of(text.data)) in ("scenario", "campaign"):
        hint = "A vehicle file has the keys mass, inertia, thrusters, ..., as in examples/my_rov.yaml"
        raise wrong_file(path, what, "be a vehicle file", f"a {kind}", hint=hint)
    forgotten = {alternative for key in changes for alternative in INSTEAD.get(key, ())} - set(changes)
    contents = {"name": path.stem, **text.data, **changes}
    contents = {key: value for key, value in contents.items() if key not in forgotten}
    changed = frozenset(changes) | (frozenset((_VALUES,)) if values else frozenset[str]())
    with error_location(location=_location(text, changed)):
        contents, deviations = without_deviations(contents)
        data = parse(contents)
        uncertainty = uncertainty_of(contents, deviations, data.hull)
        if uncertainty is not None:
            contents[SECTION] = uncertainty.section()
        if values:
            contents = with_parameters(contents, data.hull, values)
            data = parse(contents)
        return VehicleFile(data, contents, text, changed, uncertainty)


def _flat(location: str, values: Any) -> dict[str, float]:
    """Values of parameters by name: `{added_mass: {surge: 6}}` is that of `added_mass.surge`."""
    if not isinstance(values, Mapping):
        raise BadInput(location, "be a mapping of parameters of the vehicle to numbers", values)
    flat: dict[str, float] = {}
    for key, value in values.items():
        inner = f"{location}.{key}"
        if isinstance(value, Mapping):
            flat |= {f"{key}.{name}": number for name, number in _flat(inner, value).items()}
        else:
            flat[str(key)] = checked(inner, value, float, 0.0)
    if location == _VALUES:
        for name in flat:
            check_name(f"{location}.{name}", name)
            if is_outside(name):
                raise BadInput(f"{location}.{name}", "be given at `plant.thruster`", flat[name])
    return flat


def vehicle_location(scenario: Text) -> Callable[[str], str]:
    """Location of a key of a scenario's vehicle: a line of the vehicle file, or of the scenario where that sets it."""
    plant = scenario.data.get("plant")
    vehicle = plant.get("vehicle") if isinstance(plant, Mapping) else None
    options = {"kind": vehicle} if isinstance(vehicle, str) else dict(vehicle or {})
    name = options.pop("kind", "")
    in_scenario = lambda key: scenario.location(f"plant.vehicle.{key}")
    if not is_vehicle_file(name) or "contents" in options or not (scenario.folder / name).is_file():
        return in_scenario
    in_file = _location(read(scenario.folder / name), frozenset(options))
    return lambda key: in_file(key) or in_scenario(key)


def _location(text: Text, changed: frozenset[str]) -> Callable[[str], str]:
    """Location of a key in the file, or of the key from which it follows; none where it has been changed."""

    def location(name: str) -> str:
        source_key = name if name in text.data else _FROM.get(name, name)
        return "" if set(key_path(source_key)[:1]) & changed else text.location(source_key)

    return location
