"""A disturbance replayed from samples."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Load
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance


class TabulatedDisturbance(AbstractSmoothDisturbance):
    """Samples of the lumped acceleration, linear in between, constant before the first and after the last.

    Raises:
        BadInput: fewer than two samples, not finite, or times that do not increase.
    """

    samples: Float[Param, "rows columns"] = param("s, then m/s^2 or rad/s^2", "rows (t, d1, d2, ...)")

    def __check_init__(self):
        checks.rows_over_time("samples", self.samples, "t, d1, d2, ...")

    def at(self, realization, t, pose, load: Load) -> Load:
        axes = load.acceleration.shape[0]
        if self.samples.shape[1] != 1 + axes:
            raise BadInput("samples", f"have columns t, d1..d{axes}", f"a table of {self.samples.shape[1]} columns")
        times, values = self.samples[:, 0], self.samples[:, 1:]
        signal = jax.vmap(jnp.interp, in_axes=(None, None, 1))(t, times, values)
        return load._replace(acceleration=load.acceleration + signal)


def table(samples) -> TabulatedDisturbance:
    """Lumped acceleration replayed from rows (t, d1, d2, ...); in a scenario, `file: d.csv` gives them.

    Args:
        samples: rows of time (s) and one value per axis (m/s^2, rad/s^2), linear in between.
    """
    return TabulatedDisturbance(samples)
