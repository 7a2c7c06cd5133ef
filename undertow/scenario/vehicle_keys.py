"""Keys of a vehicle file: contents, unit and shape of each."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.values import checked

_AXES, _SIX = "forward, starboard, down", "surge, sway, heave, roll, pitch, yaw"
SCALARS = {
    "mass": "kg",
    "weight": "N",
    "gravity": "m/s^2",
    "buoyancy": "N",
    "volume": "m^3",
    "water_density": "kg/m^3",
}
VECTORS = {"r_g": _AXES, "r_b": _AXES, "size": "length, width, height"}
MATRICES = {"inertia": (3, "about forward, starboard, down")} | {
    name: (6, _SIX) for name in ("added_mass", "linear_damping", "quadratic_damping")
}
_REQUIRED = ("mass", "r_g", "r_b", *MATRICES, "thrusters")
KEYS = ("name", "source", "inertia_about", *SCALARS, *VECTORS, *MATRICES, "thrusters", "thruster_matrix")

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
