"""When a fault occurs and how severe it is: given, or sampled uniformly from ranges for every run."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from undertow.core.numerics.number import Number
from undertow.core.param import Param, param


class Timing(NamedTuple):
    """Time and severity of a fault in one run."""

    onset: Float[Array, ""]  # s
    stop: Float[Array, ""]  # s
    severity: Float[Array, ""]

    def active(self, t: Number) -> Bool[Array, ""]:
        """Whether the fault is present: from its onset on, and no longer at its end.

        Times of control steps are rounded products, so that a fault counts as begun some roundings early.
        """
        later = jnp.asarray(t) * (1 + 4 * jnp.finfo(jnp.result_type(float)).eps)
        return (later >= self.onset) & (later < self.stop)


class Occurrence(eqx.Module):
    """Ranges of onset and severity, which are equal numbers where nothing is random, and the duration."""

    onset: Float[Param, "2"] = param("s", "range of the time at which it begins")
    duration: Float[Param, ""] = param("s", "how long it lasts; infinite for ever")
    severity: Float[Param, "2"] = param("", "range of the severity")

    def realize(self, key: PRNGKeyArray) -> Timing:
        """Time and severity in one run."""
        share = jax.random.uniform(key, (2,), self.onset.dtype)
        onset = self.onset[0] + share[0] * (self.onset[1] - self.onset[0])
        severity = self.severity[0] + share[1] * (self.severity[1] - self.severity[0])
        return Timing(onset, onset + self.duration, severity)

    def fixed(self) -> Timing:
        """The same where nothing is random."""
        return Timing(self.onset[0], self.onset[0] + self.duration, self.severity[0])

    def jumps(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration), s, at which it begins and ends, where they are the same in every run."""
        if float(self.onset[0]) != float(self.onset[1]):
            return ()
        onset = float(self.onset[0])
        return tuple(time for time in (onset, onset + float(self.duration)) if 0 < time < duration)
