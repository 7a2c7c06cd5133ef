"""What a vehicle file may say: keys, units and shapes. Whether it makes sense is the linter's question."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from undertow.analysis.vehicle_lint.facts import Facts
from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.thruster_poses import poses
from undertow.scenario.values import checked
from undertow.vehicles.published import Hull, Layout, assemble, inertia_about_origin
from undertow.vehicles.vehicle import Vehicle

_AXES, _SIX = "forward, starboard, down", "surge, sway, heave, roll, pitch, yaw"
_SCALARS = {
    "mass": "kg",
    "weight": "N",
    "gravity": "m/s^2",
    "buoyancy": "N",
    "volume": "m^3",
    "water_density": "kg/m^3",
}
_VECTORS = {"r_g": _AXES, "r_b": _AXES, "size": "length, width, height"}
_MATRICES = {"inertia": (3, "about forward, starboard, down")} | {
    name: (6, _SIX) for name in ("added_mass", "linear_damping", "quadratic_damping")
}
_REQUIRED = ("mass", "r_g", "r_b", *_MATRICES, "thrusters")
KEYS = ("name", "source", "inertia_about", *_SCALARS, *_VECTORS, *_MATRICES, "thrusters", "thruster_matrix")

# Ways of saying the same: where one is given, the others are not.
INSTEAD = {
    "weight": ("gravity",),
    "gravity": ("weight",),
    "buoyancy": ("volume", "water_density"),
    "volume": ("buoyancy",),
    "water_density": ("buoyancy",),
}
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
        """What the linter looks at."""
        hull, inertia = self.hull, np.asarray(self.hull.inertia)
        if hull.inertia_about_origin:
            inertia = inertia_about_origin(inertia, -hull.mass, hull.r_g)  # back to the centre of gravity
        numbers = {name: np.asarray(getattr(hull, name)) for name in ("r_g", "r_b", *_MATRICES) if name != "inertia"}
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
    _check_keys(contents)
    numbers = {key: _number(contents, key) for key in _SCALARS if key in contents}
    vectors = {key: _vector(contents, key) for key in _VECTORS if key in contents}
    matrices = {key: _matrix(contents, key) for key in _MATRICES}
    positions, directions = poses(contents["thrusters"])
    source, gravity = _text(contents, "source", "not said"), numbers.get("gravity", _GRAVITY)
    weight, notes = numbers.get("weight", numbers["mass"] * gravity), {}
    if "weight" not in numbers:
        notes["weight"] = f"derived: m g with g = {gravity:g} m/s^2"
    if "volume" in numbers:
        notes["buoyancy"] = f"derived: {numbers['volume']:g} m^3 of {numbers['water_density']:g} kg/m^3; {source}"
        numbers["buoyancy"] = numbers["water_density"] * numbers["volume"] * weight / numbers["mass"]
    about = _text(contents, "inertia_about", "centre_of_gravity")
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
        name=_text(contents, "name", "vehicle"),
        hull=hull,
        layout=Layout(source, positions, directions),
        size=vectors.get("size"),
        printed_matrix=_printed(contents, len(positions)),
        water_density=numbers.get("water_density"),
    )


def _check_keys(contents: Mapping[str, Any]) -> None:
    for key in contents:
        if key not in KEYS:
            raise BadInput(key, "be a key of a vehicle file", "unknown", hint=did_you_mean(key, KEYS))
        for other in INSTEAD.get(key, ()):
            if other in contents:
                raise BadInput(key, f"be left out when there is `{other}`", contents[key])
    for key in _REQUIRED:
        if key not in contents:
            raise BadInput(key, "be given")
    if "buoyancy" not in contents:
        for key in ("volume", "water_density"):
            if key not in contents:
                raise BadInput(
                    key, "be given", hint="Or `buoyancy`, N, instead of `volume`, m^3, and `water_density`, kg/m^3"
                )


def _text(contents: Mapping[str, Any], key: str, default: str) -> str:
    return str(checked(key, contents.get(key, default), str, default))


def _number(contents: Mapping[str, Any], key: str) -> float:
    number = float(checked(key, contents[key], float, 0.0))
    checks.positive(key, number, _SCALARS[key])
    return number


def _vector(contents: Mapping[str, Any], key: str) -> NDArray:
    value = checked(key, contents[key], None, 0.0)
    checks.length(key, value, 3, _VECTORS[key])
    if key == "size":
        checks.positive(key, value, "m")
    return np.asarray(value, dtype=float)


def _matrix(contents: Mapping[str, Any], key: str) -> NDArray:
    array = np.asarray(checked(key, contents[key], None, 0.0), dtype=float)
    size, entries = _MATRICES[key]
    if array.shape not in ((size,), (size, size)):
        got = f"{len(array)} long" if array.ndim == 1 else f"of shape {array.shape}"
        raise BadInput(key, f"be the {size} diagonal entries ({entries}) or a {size} x {size} matrix", got)
    return np.diag(array) if array.ndim == 1 else array


def _printed(contents: Mapping[str, Any], thrusters: int) -> NDArray | None:
    if "thruster_matrix" not in contents:
        return None
    array = np.asarray(checked("thruster_matrix", contents["thruster_matrix"], None, 0.0), dtype=float)
    if array.shape != (6, thrusters):
        must = f"have 6 rows ({_SIX}) with one entry for each of the {thrusters} thrusters"
        raise BadInput("thruster_matrix", must, f"of shape {array.shape}")
    return array
