"""Contents of a vehicle file, checked for form. The linter checks whether the numbers are plausible."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.scenario.thruster_poses import poses
from undertow.scenario.vehicle_keys import (
    MATRICES,
    SCALARS,
    VECTORS,
    check_keys,
    matrix_at,
    number_at,
    printed_matrix,
    text_at,
    vector_at,
)
from undertow.vehicles.facts import Facts
from undertow.vehicles.published import Hull, Layout, assemble, inertia_about_origin
from undertow.vehicles.vehicle import Vehicle

_GRAVITY = 9.81  # m/s^2, when neither weight nor gravity is given
_ROUNDING = 5e-3  # a direction printed as (0.71, 0.71, 0) is this far from length 1


class VehicleData(NamedTuple):
    """A vehicle file, well formed: numbers as given, matrices whole."""

    name: str
    hull: Hull
    layout: Layout  # directions with the length they were given
    size: NDArray | None  # m
    printed_matrix: NDArray | None  # 6 x N
    water_density: float | None  # kg/m^3

    def vehicle(self) -> Vehicle:
        """The vehicle.

        Raises:
            BadInput: a direction that is not of length 1, or a body that cannot be.
        """
        directions = np.asarray(self.layout.directions)
        lengths = np.linalg.norm(directions, axis=1)
        for j in np.flatnonzero(~(np.abs(lengths - 1) < _ROUNDING)):
            name, hint = f"thrusters[{j}].direction", "Divide it by its length"
            raise BadInput(name, "have length 1", f"{lengths[j]:.6g} long", hint=hint)
        return assemble(self.name, self.hull, self.layout._replace(directions=directions / lengths[:, None]))

    def facts(self) -> Facts:
        """The facts that the linter checks."""
        hull, inertia = self.hull, np.asarray(self.hull.inertia)
        if hull.inertia_about_origin:
            inertia = inertia_about_origin(inertia, -hull.mass, hull.r_g)  # back to the centre of gravity
        numbers = {name: np.asarray(getattr(hull, name)) for name in ("r_g", "r_b", *MATRICES) if name != "inertia"}
        return Facts(
            name=self.name,
            mass=hull.mass,
            weight=hull.weight,
            buoyancy=hull.buoyancy,
            inertia=inertia,
            positions=np.asarray(self.layout.positions),
            directions=np.asarray(self.layout.directions),
            size=self.size,
            printed_matrix=self.printed_matrix,
            water_density=self.water_density,
            **numbers,
        )


def parse(contents: Mapping[str, Any]) -> VehicleData:
    """A vehicle file from its contents.

    Raises:
        BadInput: unknown or missing key, wrong type, length or sign; key names are those of the file.
    """
    check_keys(contents)
    numbers = {key: number_at(contents, key) for key in SCALARS if key in contents}
    vectors = {key: vector_at(contents, key) for key in VECTORS if key in contents}
    matrices = {key: matrix_at(contents, key) for key in MATRICES}
    positions, directions = poses(contents["thrusters"])
    source, gravity = text_at(contents, "source", "not said"), numbers.get("gravity", _GRAVITY)
    weight, notes = numbers.get("weight", numbers["mass"] * gravity), {}
    if "weight" not in numbers:
        notes["weight"] = f"derived: m g with g = {gravity:g} m/s^2"
    if "volume" in numbers:
        notes["buoyancy"] = f"derived: {numbers['volume']:g} m^3 of {numbers['water_density']:g} kg/m^3; {source}"
        numbers["buoyancy"] = numbers["water_density"] * numbers["volume"] * weight / numbers["mass"]
    about = text_at(contents, "inertia_about", "centre_of_gravity")
    checks.choice("inertia_about", about, ("centre_of_gravity", "origin"))
    hull = Hull(
        source=source,
        mass=numbers["mass"],
        weight=weight,
        buoyancy=numbers["buoyancy"],
        r_g=vectors["r_g"],
        r_b=vectors["r_b"],
        inertia_about_origin=about == "origin",
        notes=notes,
        **matrices,
    )
    return VehicleData(
        name=text_at(contents, "name", "vehicle"),
        hull=hull,
        layout=Layout(source, positions, directions),
        size=vectors.get("size"),
        printed_matrix=printed_matrix(contents, len(positions)),
        water_density=numbers.get("water_density"),
    )
