"""A signal that comes and goes."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.faults.mode import INPUTS, READINGS, AbstractMode, Altered, Severity
from undertow.numerics.random_keys import numbered


class Intermittent(AbstractMode):
    """Lost for random periods of equal length: a reading keeps its last value, an input is zero."""

    period: Float[Param, ""] = param("s", "length of each period, which is lost as a whole or not")
    targets = (*READINGS, *INPUTS)
    severity = Severity("probability that a period is lost", "", 0.5, 0.0, 1.0)
    delays = False

    def __check_init__(self):
        checks.positive("period", self.period, "s")

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        period = jnp.floor(moment.since / self.period + 1e-6).astype(int)
        chance = jax.random.uniform(numbered(moment.key, period), (), value.dtype)
        lost = moment.active & (chance < moment.severity)
        held = jnp.where(lost, memory, value)
        silent = held if moment.holds else jnp.where(lost, jnp.zeros_like(value), value)
        return Altered(silent, ~lost), held


def intermittent(period: float = 0.2) -> Intermittent:
    """Lost now and then, as by a loose contact.

    Args:
        period: length of each period, s, which is lost as a whole or not.
    """
    return Intermittent(period)
