"""Write a vehicle file: numbers with units, how sure they are, and where they come from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario.factory import INNER
from undertow.scenario.reading import dump
from undertow.scenario.uncertain_number import UncertainNumber
from undertow.scenario.vehicle_file import read_vehicle
from undertow.scenario.vehicle_parameters import (
    ADJUSTED_OPTIONS,
    check_name,
    default_outside,
    is_outside,
    parameter_values,
    unit_of,
)
from undertow.scenario.vehicle_uncertainty import SECTION, VehicleUncertainty

_HEAD = (
    "# Axes: x forward, y starboard, z down. Lists of six: surge, sway, heave, roll, pitch, yaw; all positive.\n"
    "# Check it with `undertow check {name}`.\n"
)
_COMMENTS = {
    "size": "m; length, width, height",
    "mass": "kg, in air",
    "weight": "N",
    "gravity": "m/s^2",
    "buoyancy": "N, fully submerged",
    "volume": "m^3 of displaced water",
    "water_density": "kg/m^3",
    "r_g": "m, centre of gravity",
    "r_b": "m, centre of buoyancy",
    "inertia": "kg m^2",
    "added_mass": "kg, kg m, kg m^2",
    "linear_damping": "N s/m, N s, N m s",
    "quadratic_damping": "N s^2/m^2, N s^2, N m s^2",
    "thrusters": "m; position, and direction of positive thrust",
    "thruster_matrix": "as printed in the source; only compared with the poses",
    SECTION: "standard deviations, and correlations: of a positive number those of its logarithm",
    "identified": "where these numbers come from",
}


def write_vehicle(
    path: Path,
    contents: Mapping[str, Any],
    values: Mapping[str, float],
    deviations: Mapping[str, float],
    correlation: Float[np.ndarray, "P P"] | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write a vehicle file whose numbers read back as they are; the file is whole or not there.

    Args:
        path: of the file.
        contents: of the vehicle file that is the base, or `contents_of` a vehicle.
        values: of parameters, by name (`vehicle_parameters.NAMES`); the others stay those of the base.
        deviations: standard deviation of each parameter that has one, by name.
        correlation: of these, in their order; None for none.
        provenance: plain data for the section `identified`: date, version, logs with sha256, what was fixed.

    Raises:
        BadInput: unknown names, or numbers that cannot be a vehicle's.
    """
    for name in (*values, *deviations):
        check_name("values", name)
    inside = {name: float(value) for name, value in values.items() if not is_outside(name)}
    base = {key: value for key, value in contents.items() if key not in (SECTION, "identified")}
    vehicle_file = read_vehicle(path, {"contents": base, "values": inside})
    changed = dict(vehicle_file.contents)
    changed.pop(SECTION, None)  # of numbers that stand with deviations in the base
    numbers: dict[str, UncertainNumber] = {}
    if deviations:
        known = parameter_values(vehicle_file.data.hull) | {
            name: float(values.get(name, default_outside(name))) for name in deviations if is_outside(name)
        }
        numbers = {name: UncertainNumber(known[name], float(deviation)) for name, deviation in deviations.items()}
        matrix = np.eye(len(numbers)) if correlation is None else np.asarray(correlation, dtype=float)
        if matrix.shape != (len(numbers), len(numbers)):
            raise BadInput("correlation", f"have {len(numbers)} rows and columns", f"of shape {matrix.shape}")
        changed[SECTION] = VehicleUncertainty(numbers, matrix).section()
    if provenance:
        changed["identified"] = dict(provenance)
    read_vehicle(path, {"contents": changed}).vehicle()  # raises what would be wrong with the file
    text = _HEAD.format(name=path.name) + _with_comments(dump(changed))
    write_whole(path, text + (_in_words(numbers) if numbers else ""))


def contents_of(vehicle: VehicleModel) -> dict[str, Any]:
    """Contents of a vehicle file for a vehicle of the catalogue; its inertia is about the origin."""
    numbers = lambda name: np.asarray(getattr(vehicle, name), dtype=float).tolist()
    poses = zip(numbers("thruster_positions"), numbers("thruster_directions"), strict=True)
    thrusters: list[dict[str, Any]] = [{"position": position, "direction": direction} for position, direction in poses]
    for thruster, name in zip(thrusters, vehicle.own_thruster_names, strict=False):
        if name:
            thruster["name"] = name
    scalars = ("mass", "weight", "buoyancy", "r_g", "r_b")
    matrices = ("inertia", "added_mass", "linear_damping", "quadratic_damping")
    return {
        "name": vehicle.name,
        "source": dict(vehicle.sources).get("*", "not said"),
        **({} if vehicle.size is None else {"size": numbers("size")}),
        **{name: numbers(name) for name in scalars},
        "inertia_about": "origin",
        **{name: _diagonal_or_whole(numbers(name)) for name in matrices},
        "thrusters": thrusters,
    }


def plant_section(
    plant: Mapping[str, Any], vehicle: str, thrusters: int, values: Mapping[str, float]
) -> dict[str, Any]:
    """The section `plant` of a scenario with a vehicle file, and with gains and lag of the thrusters.

    Gains of single thrusters are those of a thruster inside the one with the common gain. A delay of commands is no
    part of a plant.

    Args:
        plant: section of the scenario that was the base.
        vehicle: name of the vehicle file.
        thrusters: their number.
        values: of parameters, by name; those that the vehicle file holds are left to it.

    Raises:
        BadInput: a gain of a thruster that the base does not have.
    """
    section = {**plant, "vehicle": vehicle}
    thruster = section.get("thruster", INNER["thruster"][1])
    of_one = {int(name.partition(".T")[2]): value for name, value in values.items() if ".T" in name}
    if of_one:
        if max(of_one) > thrusters:
            raise BadInput(f"thruster_gain.T{max(of_one)}", f"be of one of {thrusters} thrusters", max(of_one))
        gains = [float(of_one.get(j + 1, 1.0)) for j in range(thrusters)]
        thruster = {"kind": "adjusted", "thruster": thruster, "gain": gains}
    options = {option: float(values[name]) for name, option in ADJUSTED_OPTIONS.items() if name in values}
    if options or of_one:
        section["thruster"] = {"kind": "adjusted", "thruster": thruster, **options} if options else thruster
    return section


def _diagonal_or_whole(matrix: list[list[float]]) -> Any:
    array = np.asarray(matrix)
    return np.diagonal(array).tolist() if np.array_equal(array, np.diag(np.diagonal(array))) else matrix


def _with_comments(text: str) -> str:
    """The file with a comment on the first line of each key."""
    lines = []
    for line in text.splitlines():
        comment = _COMMENTS.get(line.partition(":")[0], "")
        lines.append(f"{line}  # {comment}" if comment else line)
    return "\n".join(lines) + "\n"


def _in_words(numbers: Mapping[str, UncertainNumber]) -> str:
    """The section `uncertainty` for people: comments with four digits."""
    lines = [f"#   {name}: {n.value:.4g} +- {n.deviation:.2g} {unit_of(name)}".rstrip() for name, n in numbers.items()]
    return "\n".join(["# In short:", *lines]) + "\n"
