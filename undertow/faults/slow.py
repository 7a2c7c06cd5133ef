"""A signal with a lag."""

import jax.numpy as jnp

from undertow.faults.mode import INPUTS, READINGS, AbstractMode, Altered, Severity


class Slow(AbstractMode):
    """First-order lag, dv/dt = (signal - v) / tau, by the implicit Euler method; angles go the shorter way round."""

    targets = (*READINGS, *INPUTS)
    severity = Severity("time constant", "s", 0.5, 0.0, 100.0)
    delays = False

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        span = jnp.maximum(moment.elapsed, 0.0)
        share = jnp.where(span > 0, span / jnp.where(span > 0, span + moment.severity, 1.0), 0.0)
        lagging = memory + share * moment.difference(value, memory)
        return Altered(lagging, jnp.asarray(True)), jnp.where(moment.active, lagging, value)


def slow() -> Slow:
    """First-order lag of the signal."""
    return Slow()
