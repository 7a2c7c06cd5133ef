"""A motion replayed from samples."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.numerics.spline import clamped_slopes, spline
from undertow.core.param import Param, param


class Recorded(AbstractReference):
    """The C2 cubic spline through samples of the position, at rest at both ends, constant before and after.

    Raises:
        BadInput: fewer than two samples, not finite, or times that do not increase.
    """

    samples: Float[Param, "rows columns"] = param("s, then m or rad", "rows (t, p1, p2, ...)")
    velocities: Float[Param, "rows n"] = param("m/s, rad/s", "velocity at each row, computed from all rows")

    def __init__(self, samples):
        rows = np.asarray(samples, dtype=float)
        checks.rows_over_time("samples", rows, "t, p1, p2, ...")
        self.samples = jnp.asarray(rows)
        self.velocities = jnp.asarray(clamped_slopes(rows[:, 0], rows[:, 1:]))

    def at(self, t) -> Target:
        return Target(*spline(t, self.samples[:, 0], self.samples[:, 1:], self.velocities))


def recorded(samples) -> Recorded:
    """Positions replayed from rows (t, p1, p2, ...); in a scenario, `file: d.csv` gives them (header t,d1,d2,...).

    C2 in between, at rest before the first row and after the last; the acceleration jumps there.

    Args:
        samples: rows of time (s) and one value per output (m, rad). Angles are continuous: they pass through +-pi
            without a jump of 2 pi.
    """
    return Recorded(samples)
