"""Waypoints, visited one after the other."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.spline import clamped_slopes, spline
from undertow.core.param import Param, param


class Waypoints(AbstractReference):
    """The C2 cubic spline through the waypoints over straight distance / speed; at rest before and after.

    Raises:
        BadInput: points that are not two or more finite rows of three, two equal ones in a row, speed not positive,
            unknown heading, or an undefined one because the path is vertical.
    """

    path: Float[Param, "rows 7"] = param("m, then m and rad", "rows (straight distance from the first, six outputs)")
    slopes: Float[Param, "rows 6"] = param("1, rad/m", "change per distance at each row, computed from all rows")
    speed: Float[Param, ""] = param("m/s", "mean speed from one waypoint to the next")

    def __init__(self, points, speed, heading: str = "fixed"):
        rows = np.asarray(points, dtype=float)
        if rows.ndim != 2 or rows.shape[0] < 2 or rows.shape[1] != 3:
            raise BadInput("points", "have two or more rows (north, east, down)", f"of shape {rows.shape}")
        checks.finite("points", rows, "m")
        checks.positive("speed", speed, "m/s")
        checks.choice("heading", heading, ("fixed", "along"))
        distances = np.linalg.norm(np.diff(rows, axis=0), axis=1)
        if not distances.all():
            raise BadInput("points", "differ from row to row", f"row {int(np.argmin(distances)) + 2} a repetition")
        yaw = _bisectors(rows) if heading == "along" else np.zeros(len(rows))
        covered = np.concatenate([[0.0], np.cumsum(distances)])
        outputs = np.column_stack([rows, np.zeros((len(rows), 2)), yaw])
        self.path = jnp.asarray(np.column_stack([covered, outputs]))
        self.slopes = jnp.asarray(clamped_slopes(covered, outputs))
        self.speed = speed

    def at(self, t) -> Target:
        pose, slope, second = spline(self.speed * t, self.path[:, 0], self.path[:, 1:], self.slopes)
        return Target(pose, self.speed * slope, self.speed**2 * second)


def waypoints(points, speed: float = 0.5, heading: str = "fixed") -> Waypoints:
    """Smooth motion (C2) through waypoints, level, for a vehicle; at rest at the first (t = 0) and at the last.

    Let the first be where the vehicle starts (`initial` of a scenario): from 1 m away on, `check` and `simulate` give
    advice, for the run begins with an error of that size. For given times, or outputs other than these, see `recorded`.

    Args:
        points: rows (north, east, down), m.
        speed: mean speed from one waypoint to the next, m/s. The largest speed of the first and the last
            segment is about 1.5 times as large.
        heading: yaw, `fixed` at zero, or `along` the path: at a waypoint it bisects the directions of its segments, at
            either end it is the direction of the segment, smooth in between.
    """
    return Waypoints(points, speed, heading)


def _bisectors(points: Float[np.ndarray, "rows 3"]) -> Float[np.ndarray, " rows"]:
    """Yaw at every waypoint, continuous (rad). Where the path is vertical the yaw is kept."""
    north, east = np.diff(points[:, :2], axis=0).T
    level = np.flatnonzero((north != 0) | (east != 0))
    if not level.size:
        raise BadInput("heading", "be fixed when the way is vertical", "along")
    latest = level[np.maximum(np.searchsorted(level, np.arange(len(north)), side="right") - 1, 0)]
    ways = np.unwrap(np.arctan2(east, north)[latest])
    return np.concatenate([ways[:1], (ways[1:] + ways[:-1]) / 2, ways[-1:]])
