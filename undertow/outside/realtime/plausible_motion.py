"""The gate of every link: motions of no underwater vehicle are refused before a law sees them.

One wrong number that is finite can end control: a law that believes a velocity of 1e38 m/s does not recover. What these
limits let through, such as a position that jumps by 100 m, is for a supervisor to judge.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from undertow.core.errors import BadInput

POSITION, SPEED, RATE = 1e4, 20.0, 20.0  # m from the origin of the frame; m/s; rad/s

_LIMITS = (("position", POSITION, "m"), ("velocity", SPEED, "m/s"), ("angular velocity", RATE, "rad/s"))


def is_plausible(position: ArrayLike, velocity: ArrayLike) -> bool:
    """Whether a motion is that of a vehicle; numbers that are not finite were not measured.

    Args:
        position: north, east, down, m.
        velocity: u, v, w, m/s, and p, q, r, rad/s.
    """
    return next(_beyond(position, velocity), None) is None


def check_plausible(what: str, position: ArrayLike, velocity: ArrayLike) -> None:
    """Check that a motion is that of a vehicle; arguments as those of `is_plausible`.

    Raises:
        BadInput: it is not; `what` is the message in which it came.
    """
    for name, limit, unit, largest in _beyond(position, velocity):
        hint = "Give positions from a place nearby" if name == "position" else ""
        raise BadInput(f"{what} {name}", f"be at most {limit:g} {unit}", f"{largest:.4g} {unit}", hint=hint)


def _beyond(position: ArrayLike, velocity: ArrayLike) -> Iterator[tuple[str, float, str, float]]:
    """What is beyond its limit: name, limit, unit and the largest number."""
    velocity = np.asarray(velocity, dtype=float)
    parts = np.asarray(position, dtype=float), velocity[:3], velocity[3:]
    for values, (name, limit, unit) in zip(parts, _LIMITS, strict=True):
        largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
        if largest > limit:
            yield name, limit, unit, float(largest)
