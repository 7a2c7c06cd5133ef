"""Sampling of a sensor: when it gives a reading, and its errors: noise, bias, correlated errors, resolution, delay,
dropout.
"""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtri
from jaxtyping import Array, Bool, Float, Int

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param
from undertow.physics.sensors.gauss_markov import CorrelatedErrors, Disturbed, ErrorValues

Reading = Float[Array, " width"]

# Share of a sampling period: times of the loop are multiples of a step, which are rounded.
_EARLY = 1e-6


class SensorState(NamedTuple):
    """Samples that are taken but not yet delivered."""

    taken: Int[Array, ""]  # number of the last sample taken, from 0
    arrived: Int[Array, ""]  # number of the last sample delivered
    readings: Float[Array, "slots width"]  # sample k is kept in slot k modulo slots
    lost: Bool[Array, " slots"]
    offset: Reading  # of this run
    errors: ErrorValues | None = None  # correlated errors of the last sample; None where the sensor has none


class Delivery(NamedTuple):
    """Reading that is delivered at one instant."""

    reading: Reading
    fresh: Bool[Array, ""]  # whether it is new


class Sampling(eqx.Module):
    """Sample k is taken at k period, or at the first step of the loop after it, and delivered a delay later.

    reading = resolution round((truth + bias + noise + correlated errors) / resolution). The noise is new for every
    sample and depends on its number only, not on the rate of the loop; the bias is sampled once per run. Where several
    samples fall between two steps, the newest is delivered; the correlated errors pass over the others exactly. Single
    precision cannot count more than 2^24 samples.

    Raises:
        BadInput: a period not positive, a probability of one or more, anything else negative.
    """

    period: Float[Param, ""] = param("s", "between two samples")
    noise: Float[Param, "..."] = param("as read", "standard deviation, new for every sample", default=0.0)
    bias: Float[Param, "..."] = param("as read", "standard deviation of an offset, sampled once per run", default=0.0)
    resolution: Float[Param, "..."] = param("as read", "step of the reading; 0 for none", default=0.0)
    delay: Float[Param, ""] = param("s", "from taking a sample to delivering it", default=0.0)
    dropout: Float[Param, ""] = param("", "probability that a sample is lost", default=0.0)
    slots: int = eqx.field(static=True, default=0)  # undelivered samples at most; from delay and period
    errors: CorrelatedErrors | None = None

    def __post_init__(self):
        checks.positive("period", self.period, "s")
        for name in ("noise", "bias", "resolution", "delay", "dropout"):
            checks.not_negative(name, getattr(self, name))
        if not checks.assumed(lambda share: share < 1, self.dropout):
            raise BadInput("dropout", "be less than 1", f"{float(self.dropout):g}")
        if not self.slots:
            self.slots = math.ceil(float(np.asarray(self.delay) / np.asarray(self.period)) - _EARLY) + 1

    def init(self, reading: Reading, chance: Reading, error_chance: ErrorValues | None = None) -> SensorState:
        """State before the first sample.

        Args:
            reading: any, for its shape.
            chance: one standard normal number per entry, for the bias.
            error_chance: one per correlated error; None where there are none.
        """
        nothing = jnp.asarray(-1, dtype=int)
        readings = jnp.zeros((self.slots, *reading.shape), reading.dtype)
        errors = None if self.errors is None or error_chance is None else self.errors.start(error_chance)
        return SensorState(nothing, nothing, readings, jnp.zeros(self.slots, dtype=bool), self.bias * chance, errors)

    def number(self, t) -> Int[Array, ""]:
        """Number of the newest sample taken by time t, from 0."""
        return jnp.floor(t / self.period + _EARLY).astype(int)

    def deliver(
        self,
        state: SensorState,
        t,
        truth: Reading,
        chance: Float[Array, " width+1"],
        disturbed: Disturbed | None = None,
    ) -> tuple[Delivery, SensorState]:
        """Delivery at time t, and the state afterwards.

        Args:
            state: that after the previous instant.
            t: s.
            truth: exact reading at time t.
            chance: standard normal numbers of sample `number(t)`: one per entry, one for being lost.
            disturbed: what correlated errors do to that sample; None where there are none.
        """
        newest, due = self.number(t), self.number(t - self.delay)
        # Samples between two steps are all taken of the present true state.
        numbers = newest - (newest - jnp.arange(self.slots)) % self.slots
        new = numbers > state.taken
        exact, errors = truth + state.offset + self.noise * chance[:-1], state.errors
        if self.errors is not None and errors is not None and disturbed is not None:
            passed = (newest - state.taken).astype(errors.dtype) * self.period
            errors = self.errors.after(errors, passed, disturbed.chance)
            exact = exact + matvec(disturbed.slopes, errors)
        readings = jnp.where(new[:, None], self._rounded(exact), state.readings)
        lost = jnp.where(new, chance[-1] < ndtri(self.dropout), state.lost)
        slot = due % self.slots
        fresh = (due > state.arrived) & (due >= 0) & ~lost[slot]
        state = SensorState(newest, jnp.maximum(due, state.arrived), readings, lost, state.offset, errors)
        return Delivery(readings[slot], fresh), state

    def _rounded(self, exact: Reading) -> Reading:
        step = jnp.where(self.resolution > 0, self.resolution, 1.0)
        return jnp.where(self.resolution > 0, step * jnp.round(exact / step), exact)
