"""Poses of thrusters in a vehicle file."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.values import checked

_KEYS = ("position", "direction", "azimuth", "elevation")
_FARTHEST = 1e9
_AXES = "forward, starboard, down"


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
        if key not in _KEYS:
            raise BadInput(f"{name}.{key}", "be a key of a thruster", "unknown", hint=did_you_mean(key, _KEYS))
    angles = [key for key in ("azimuth", "elevation") if key in entry]
    if "direction" in entry and angles:
        raise BadInput(f"{name}.{angles[0]}", "be left out when there is a `direction`", entry[angles[0]])
    if angles:
        return _vector(name, entry, "position"), _pointing(
            *(_angle(name, entry, key) for key in ("azimuth", "elevation"))
        )
    return _vector(name, entry, "position"), _vector(name, entry, "direction")


def _vector(name: str, entry: Mapping[str, Any], key: str) -> NDArray:
    if key not in entry:
        hint = "" if key == "position" else "Or give `azimuth` and `elevation` in degrees"
        raise BadInput(f"{name}.{key}", "be given", hint=hint)
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
