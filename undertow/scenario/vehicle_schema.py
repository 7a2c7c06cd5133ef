"""Vehicle files: keys, units and shapes, and contents checked for form; the linter checks what is plausible."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean, joined, known_key
from undertow.core.measurement import BODY_AXES
from undertow.physics.faults.targets import is_target
from undertow.physics.vehicles.facts import Facts
from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, inertia_about_origin
from undertow.physics.vehicles.thruster_labels import check_own
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario.synonyms import hint_for
from undertow.scenario.values import checked

_AXES = "forward, starboard, down"
_SIX = ", ".join(BODY_AXES)
SCALARS = {"mass": "kg", "weight": "N", "gravity": "m/s^2", "buoyancy": "N", "volume": "m^3", "water_density": "kg/m^3"}
VECTORS = {"r_g": _AXES, "r_b": _AXES, "size": "length, width, height"}
MATRICES = {"inertia": (3, "about forward, starboard, down")} | {
    name: (6, _SIX) for name in ("added_mass", "linear_damping", "quadratic_damping")
}
# Required key -> its unit, and what it is.
_IN_WORDS = {
    "mass": "kg, in air",
    "r_g": f"centre of gravity, m ({_AXES})",
    "r_b": f"centre of buoyancy, m ({_AXES})",
    "inertia": "kg m^2, three diagonal entries or a 3 x 3 matrix",
    "added_mass": f"kg and kg m^2, six diagonal entries ({_SIX}) or a 6 x 6 matrix",
    "linear_damping": "N s/m and N m s, six diagonal entries (zero where there is none) or a 6 x 6 matrix",
    "quadratic_damping": "N s^2/m^2 and N m s^2, six diagonal entries (zero where there is none) or a 6 x 6 matrix",
    "thrusters": "a list with one entry per thruster, {position: [...], direction: [...]}",
}
KEYS = (
    *("name", "source", "inertia_about", *SCALARS, *VECTORS, *MATRICES, "thrusters", "thruster_matrix"),
    *("uncertainty", "identified"),
)

# Alternatives: where one is given, the others must not be.
INSTEAD = {
    "weight": ("gravity",),
    "gravity": ("weight",),
    "buoyancy": ("volume", "water_density"),
    "volume": ("buoyancy",),
    "water_density": ("buoyancy",),
}
_LARGEST = 1e15


def check_keys(contents: Mapping[str, Any]) -> None:
    """Raise BadInput unless all keys are known, none is redundant, and none is missing."""
    if unknown := [key for key in contents if key not in KEYS]:
        hint = hint_for((unknown[0],), "vehicle file") or did_you_mean(unknown[0], KEYS)
        hint = joined(hint, _listed("Also unknown", unknown[1:]))
        raise BadInput(unknown[0], "be a key of a vehicle file", "unknown", hint=hint)
    for key in contents:
        for alternative in INSTEAD.get(key, ()):
            if alternative in contents:
                raise BadInput(key, f"be left out when there is `{alternative}`", contents[key])
    if missing := [key for key in _IN_WORDS if key not in contents]:
        must = f"be given: {_IN_WORDS[missing[0]]}"
        raise BadInput(missing[0], must, hint=_listed("Also missing", missing[1:]))
    if "buoyancy" not in contents:
        for key in ("volume", "water_density"):
            if key not in contents:
                raise BadInput(
                    key, "be given", hint="Or `buoyancy`, N, instead of `volume`, m^3, and `water_density`, kg/m^3"
                )


def _listed(title: str, names: list[str]) -> str:
    return f"{title}: {', '.join(f'`{name}`' for name in names)}" if names else ""


def text_at(contents: Mapping[str, Any], key: str, default: str) -> str:
    """Text, or the default."""
    return str(checked(key, contents.get(key, default), str, default))


def _ordinary(key: str, value: Any) -> NDArray:
    """Numbers whose squares are finite."""
    array = np.asarray(checked(key, value, None, 0.0), dtype=float)
    if array.size and np.abs(array).max() > _LARGEST:
        raise BadInput(key, f"hold numbers below {_LARGEST:g}", value)
    return array


def number_at(contents: Mapping[str, Any], key: str) -> float:
    """A positive number."""
    number = float(_ordinary(key, checked(key, contents[key], float, 0.0)))
    checks.positive(key, number, SCALARS[key])
    if number < 1 / _LARGEST:
        raise BadInput(key, f"be above {1 / _LARGEST:g}", number)
    return number


def vector_at(contents: Mapping[str, Any], key: str) -> NDArray:
    """Three numbers, positive for a size."""
    array = _ordinary(key, contents[key])
    checks.length(key, array, 3, VECTORS[key])
    if key == "size":
        checks.positive(key, array, "m")
    return array


def matrix_at(contents: Mapping[str, Any], key: str) -> NDArray:
    """A square matrix, whole or given by its diagonal."""
    array = _ordinary(key, contents[key])
    size, entries = MATRICES[key]
    if array.shape not in ((size,), (size, size)):
        got = f"{len(array)} long" if array.ndim == 1 else f"of shape {array.shape}"
        raise BadInput(key, f"be the {size} diagonal entries ({entries}) or a {size} x {size} matrix", got)
    return np.diag(array) if array.ndim == 1 else array


def printed_matrix(contents: Mapping[str, Any], thrusters: int) -> NDArray | None:
    """The thruster matrix as printed, if there is one."""
    if "thruster_matrix" not in contents:
        return None
    array = _ordinary("thruster_matrix", contents["thruster_matrix"])
    if array.shape != (6, thrusters):
        must = f"have 6 rows ({_SIX}) with one entry for each of the {thrusters} thrusters"
        raise BadInput("thruster_matrix", must, f"of shape {array.shape}")
    return array


_THRUSTER_KEYS = ("name", "position", "direction", "azimuth", "elevation")
_FARTHEST = 1e9  # m


def poses(entries: Any) -> tuple[NDArray, NDArray]:
    """Positions (m) and directions of positive thrust, each of shape (N, 3), directions with their given length.

    Args:
        entries: one mapping per thruster: `position`, and `direction` or the angles `azimuth` (degrees, from forward
            towards starboard) and `elevation` (degrees, upward).

    Raises:
        BadInput: anything else.
    """
    if not isinstance(entries, list) or not entries:
        raise BadInput(
            "thrusters", "be a list with one entry per thruster, {position: [...], direction: [...]}", entries
        )
    pairs = [_pose(f"thrusters[{j}]", entry) for j, entry in enumerate(entries)]
    return np.array([position for position, _ in pairs]), np.array([direction for _, direction in pairs])


def _pose(name: str, entry: Any) -> tuple[NDArray, NDArray]:
    if not isinstance(entry, Mapping):
        raise BadInput(name, "be a mapping of `position` and `direction`", entry)
    for key in entry:
        if key not in _THRUSTER_KEYS:
            raise BadInput(
                f"{name}.{key}", "be a key of a thruster", "unknown", hint=known_key(str(key), _THRUSTER_KEYS)
            )
    angles = [key for key in ("azimuth", "elevation") if key in entry]
    if "direction" in entry and angles:
        raise BadInput(f"{name}.{angles[0]}", "be left out when there is a `direction`", entry[angles[0]])
    if angles:
        return _vector(name, entry, "position"), _pointing(
            *(_angle(name, entry, key) for key in ("azimuth", "elevation"))
        )
    return _vector(name, entry, "position"), _vector(name, entry, "direction")


def names_of(entries: list[dict[str, Any]]) -> tuple[str, ...]:
    """Names of thrusters as given, "" for one without; () where none has one.

    Raises:
        BadInput: a name that cannot be shown, occurs twice, or means something else that can fail.
    """
    key = lambda j: f"thrusters[{j}].name"
    names = tuple(
        " ".join(checked(key(j), entry["name"], str, "").split()) if "name" in entry else ""
        for j, entry in enumerate(entries)
    )
    for j, entry in enumerate(entries):
        if "name" in entry and not names[j]:
            raise BadInput(
                key(j), "be a name", "empty", hint="Leave it out for the name that follows from the position"
            )
    check_own(names, key)
    for j, name in enumerate(names):
        if name and is_target(name):
            raise BadInput(key(j), "be a name that means nothing else among the targets of faults", name)
    return names if any(names) else ()


def angles_of(entries: list[dict[str, Any]]) -> dict[str, float]:
    """Angles of thrusters as given, degrees, by key."""
    return {
        f"thrusters[{j}].{key}": float(entry[key])
        for j, entry in enumerate(entries)
        for key in ("azimuth", "elevation")
        if key in entry
    }


def _vector(name: str, entry: Mapping[str, Any], key: str) -> NDArray:
    if key not in entry:
        hint = "" if key == "position" else "Or give `azimuth` and `elevation` in degrees"
        raise BadInput(f"{name}.{key}", "be given", hint=hint)
    if isinstance(entry[key], str) and key == "direction":
        hint = "Forward is [1, 0, 0], starboard [0, 1, 0], down [0, 0, 1]; or give `azimuth` and `elevation` in degrees"
        raise BadInput(f"{name}.{key}", f"be three numbers ({_AXES})", entry[key], hint=hint)
    value = checked(f"{name}.{key}", entry[key], None, 0.0)
    checks.length(f"{name}.{key}", value, 3, _AXES)
    if np.abs(np.asarray(value, dtype=float)).max() > _FARTHEST:
        raise BadInput(f"{name}.{key}", f"hold numbers below {_FARTHEST:g}", value)
    return np.asarray(value, dtype=float)


def _angle(name: str, entry: Mapping[str, Any], key: str) -> float:
    return float(checked(f"{name}.{key}", entry.get(key, 0.0), float, 0.0))


def _pointing(azimuth: float, elevation: float) -> NDArray:
    """Unit vector, forward, starboard, down, from angles in degrees; right angles give exact zeros."""
    around, up = np.radians(azimuth), np.radians(elevation)
    vector = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), -np.sin(up)])
    return np.where(np.abs(vector) < 1e-15, 0.0, vector)


_GRAVITY = 9.81  # m/s^2, when neither weight nor gravity is given
_ROUNDING = 5e-3  # a direction printed as (0.71, 0.71, 0) is this far from length 1


class VehicleData(NamedTuple):
    """A vehicle file, well formed: numbers as given, matrices whole."""

    name: str
    hull: Hull
    layout: ThrusterLayout  # directions with the length they were given
    size: NDArray | None  # m
    printed_matrix: NDArray | None  # 6 x N
    water_density: float | None  # kg/m^3
    angles: dict[str, float]  # degrees, as given, by key

    def vehicle(self) -> VehicleModel:
        """The vehicle.

        Raises:
            BadInput: a direction that is not of length 1, or a body that cannot be.
        """
        directions = np.asarray(self.layout.directions)
        lengths = np.linalg.norm(directions, axis=1)
        for j in np.flatnonzero(~(np.abs(lengths - 1) < _ROUNDING)):
            name = f"thrusters[{j}].direction"
            hint = "Divide it by its length"
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
            angles=self.angles,
            **numbers,
        )


def parse(contents: Mapping[str, Any]) -> VehicleData:
    """A vehicle file from its contents, in which numbers stand without deviations.

    Raises:
        BadInput: unknown or missing key, wrong type, length or sign; key names are those of the file.
    """
    check_keys(contents)
    identified = contents.get("identified", {})
    if not isinstance(identified, Mapping):
        raise BadInput("identified", "be a mapping, such as {date: ..., logs: [...]}", identified)
    numbers = {key: number_at(contents, key) for key in SCALARS if key in contents}
    vectors = {key: vector_at(contents, key) for key in VECTORS if key in contents}
    matrices = {key: matrix_at(contents, key) for key in MATRICES}
    positions, directions = poses(contents["thrusters"])
    source, gravity = text_at(contents, "source", "not said"), numbers.get("gravity", _GRAVITY)
    weight = numbers.get("weight", numbers["mass"] * gravity)
    notes = {}
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
        size=vectors.get("size"),
        **matrices,
    )
    return VehicleData(
        name=text_at(contents, "name", "vehicle"),
        hull=hull,
        layout=ThrusterLayout(source, positions, directions, names_of(contents["thrusters"])),
        size=vectors.get("size"),
        printed_matrix=printed_matrix(contents, len(positions)),
        water_density=numbers.get("water_density"),
        angles=angles_of(contents["thrusters"]),
    )
