"""Single wrong values of a signal."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.faults.mode import INPUTS, LARGE, READINGS, TARGET, AbstractMode, Altered, Severity


class Glitch(AbstractMode):
    """An offset for one control step, at the onset and at regular intervals after it."""

    period: Float[Param, ""] = param("s", "between two glitches")
    targets = (*READINGS, *INPUTS)
    severity = Severity("offset", TARGET, 5.0, -LARGE, LARGE)
    delays = False

    def __check_init__(self):
        checks.positive("period", self.period, "s")

    def init(self, value):
        return jnp.asarray(-1, dtype=int)

    def apply(self, memory, moment, value):
        number = jnp.where(moment.active, jnp.floor(moment.since / self.period + 1e-6), -1.0).astype(int)
        return Altered(jnp.where(number > memory, value + moment.severity, value), jnp.asarray(True)), number


def glitch(period: float = 1.0) -> Glitch:
    """Single outliers.

    Args:
        period: between two of them, s.
    """
    return Glitch(period)
