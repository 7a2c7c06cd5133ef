"""The gate of every link: motions of no underwater vehicle are refused before a law sees them.

One wrong number that is finite can end control: a law that believes a velocity of 1e38 m/s does not recover. What these
limits let through, such as a position that jumps by 100 m, is for a supervisor to judge.
"""

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
    return not any(
        _beyond(values, limit) for values, (_, limit, _) in zip(_parts(position, velocity), _LIMITS, strict=True)
    )


def check_plausible(what: str, position: ArrayLike, velocity: ArrayLike) -> None:
    """Check that a motion is that of a vehicle; arguments as those of `is_plausible`.

    Raises:
        BadInput: it is not; `what` is the message in which it came.
    """
    for values, (name, limit, unit) in zip(_parts(position, velocity), _LIMITS, strict=True):
        if _beyond(values, limit):
            hint = "Give positions from a place nearby" if name == "position" else ""
            largest = np.abs(values[np.isfinite(values)]).max()
            raise BadInput(f"{what} {name}", f"be at most {limit:g} {unit}", f"{largest:.4g} {unit}", hint=hint)


def _parts(position: ArrayLike, velocity: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    velocity = np.asarray(velocity, dtype=float)
    return np.asarray(position, dtype=float), velocity[:3], velocity[3:]


def _beyond(values: np.ndarray, limit: float) -> bool:
    return bool((np.abs(values[np.isfinite(values)]) > limit).any())
