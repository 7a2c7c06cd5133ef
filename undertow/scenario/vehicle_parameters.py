"""Numbers of a vehicle by name: `added_mass.surge`, `net_buoyancy`."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from undertow.core.errors import BadInput, nearest
from undertow.core.measurement import BODY_AXES
from undertow.physics.vehicles.published import Hull, inertia_about_origin
from undertow.scenario.reading import key_path

POSITIVE, NOT_NEGATIVE, ANY = "positive", "not negative", "any"  # signs of a parameter

_TURNS, _DIRECTIONS = BODY_AXES[3:], ("x", "y", "z")
_MATRICES = {"inertia": _TURNS, "added_mass": BODY_AXES, "linear_damping": BODY_AXES, "quadratic_damping": BODY_AXES}
_VECTORS = ("r_b", "r_g")
_GAIN_OF_ONE = re.compile(r"thruster_gain\.T[1-9]\d*")

_UNITS = {"mass": ("kg", "kg"), "inertia": ("", "kg m^2"), "added_mass": ("kg", "kg m^2"), "net_buoyancy": ("N", "N")}
_UNITS |= {"linear_damping": ("N s/m", "N m s"), "quadratic_damping": ("N s^2/m^2", "N m s^2")}
_UNITS |= {"r_b": ("m", "m"), "r_g": ("m", "m"), "command_delay": ("s", "s")}

# Parameters of a vehicle with its thrusters that no key of a vehicle file holds, and their values unless given.
_OUTSIDE = {"thruster_gain": 1.0, "reverse_gain": 1.0, "lag": 1.0, "command_delay": 0.0}
# Those of all thrusters together, and the options of the thruster `adjusted` that they are.
ADJUSTED_OPTIONS = {"thruster_gain": "gain", "reverse_gain": "reverse_gain", "lag": "lag"}

NAMES = (
    "mass",
    *(f"{matrix}.{axis}" for matrix, axes in _MATRICES.items() for axis in axes),
    "net_buoyancy",
    *(f"{vector}.{direction}" for vector in _VECTORS for direction in _DIRECTIONS),
    *_OUTSIDE,
)


def check_name(location: str, name: Any) -> None:
    """Check that a parameter has a name that is known.

    Raises:
        BadInput: it has not.
    """
    if not isinstance(name, str) or (name not in NAMES and not _GAIN_OF_ONE.fullmatch(name)):
        raise BadInput(location, "be a parameter of a vehicle", repr(name), hint=nearest(str(name), NAMES))


def is_outside(name: str) -> bool:
    """Whether a parameter stands in no vehicle file, but in the scenario that uses it."""
    return name in _OUTSIDE or _GAIN_OF_ONE.fullmatch(name) is not None


def default_outside(name: str) -> float:
    """Value of such a parameter, unless it is given."""
    return _OUTSIDE[name.partition(".")[0]]


def sign_of(name: str) -> str:
    """Which values a parameter may have: POSITIVE, NOT_NEGATIVE or ANY."""
    family = name.split(".")[0]
    if family in ("mass", "inertia", "added_mass", "thruster_gain", "reverse_gain", "lag"):
        return POSITIVE
    return NOT_NEGATIVE if family in ("linear_damping", "quadratic_damping", "command_delay") else ANY


def unit_of(name: str) -> str:
    """Unit of a parameter; "" for a factor."""
    family, _, entry = name.partition(".")
    along, about = _UNITS.get(family, ("", ""))
    return about if entry in _TURNS else along


def name_at(key: str) -> str:
    """Name of the parameter at a key path of a vehicle file; "" where there is none: `added_mass[0]`, `r_b[2]`."""
    family, *places = key_path(key)
    if key == "mass":
        return key
    axes = _MATRICES.get(str(family), _DIRECTIONS if family in _VECTORS else ())
    is_diagonal = len(places) == 1 or (len(places) == 2 and places[0] == places[1])
    return f"{family}.{axes[int(places[0])]}" if is_diagonal and int(places[0]) < len(axes) else ""


def parameter_values(hull: Hull) -> dict[str, float]:
    """Values of a hull by name: inertia about the origin of the body, N, N m, m, kg and their products."""
    matrices = {name: np.asarray(getattr(hull, name), dtype=float) for name in _MATRICES}
    if np.any(hull.r_g) and not hull.inertia_about_origin:
        matrices["inertia"] = inertia_about_origin(matrices["inertia"], hull.mass, hull.r_g)
    values = {"mass": hull.mass, "net_buoyancy": hull.buoyancy - hull.weight}
    for name, axes in _MATRICES.items():
        values |= {f"{name}.{axis}": float(matrices[name][i, i]) for i, axis in enumerate(axes)}
    for name in _VECTORS:
        vector = np.asarray(getattr(hull, name), dtype=float)
        values |= {f"{name}.{direction}": float(vector[i]) for i, direction in enumerate(_DIRECTIONS)}
    return values


def with_parameters(contents: Mapping[str, Any], hull: Hull, values: Mapping[str, float]) -> dict[str, Any]:
    """Contents of a vehicle file with other values of its parameters.

    Weight follows mass, and buoyancy weight: the net buoyancy stays unless it is given. Parameters that stand in no
    vehicle file are left to the scenario.

    Args:
        contents: numbers alone, without deviations.
        hull: of these contents.
        values: by name.
    """
    changed = dict(contents)
    present = parameter_values(hull)
    if "mass" in values or "net_buoyancy" in values:
        mass = values.get("mass", hull.mass)
        weight = mass * (hull.weight / hull.mass) if mass != hull.mass else hull.weight
        for key in ("gravity", "volume", "water_density"):
            changed.pop(key, None)
        changed |= {
            "mass": mass,
            "weight": weight,
            "buoyancy": weight + values.get("net_buoyancy", present["net_buoyancy"]),
        }
    for name, value in values.items():
        family, _, entry = name.partition(".")
        if is_outside(name) or not entry:
            continue
        place = (_MATRICES.get(family) or _DIRECTIONS).index(entry)
        old = np.asarray(changed[family], dtype=float)
        # The inertia of a file may be about the centre of gravity: what lies between the origin and it stays.
        shift = present[name] - float(old[place] if old.ndim == 1 else old[place, place])
        new = old.copy()
        new[(place,) * old.ndim] = value - shift
        changed[family] = new.tolist()
    return changed
