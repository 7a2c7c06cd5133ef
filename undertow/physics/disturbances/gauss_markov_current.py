"""A random current: a first-order Gauss-Markov process on each axis."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import with_water

_LONGEST = 1_000_000  # samples of a realization


class GaussMarkovCurrent(AbstractDisturbance):
    """mean + process of a standard deviation and a correlation time, sampled every `step` for `span`.

    The samples follow the process exactly; the velocity is linear between them and constant after `span`.

    Raises:
        BadInput: a time not positive, a deviation negative, too many samples.
    """

    mean: Float[Param, "3"] = param("m/s", "mean velocity: north, east, down")
    deviation: Float[Param, "3"] = param("m/s", "standard deviation: north, east, down", symbol="sigma")
    correlation_time: Float[Param, ""] = param("s", "time in which the correlation falls to 1/e", symbol="1/mu")
    step: Float[Param, ""] = param("s", "time between samples")
    samples: int = eqx.field(static=True, default=1201)

    def __check_init__(self):
        for name in ("mean", "deviation"):
            checks.length(name, getattr(self, name), 3, "north, east, down")
        checks.finite("mean", self.mean, "m/s")
        checks.not_negative("deviation", self.deviation, "m/s")
        checks.positive("correlation_time", self.correlation_time, "s")

    def realize(self, key) -> Float[Array, "samples 3"]:
        """Deviations from the mean, m/s: x_k+1 = q x_k + sqrt(1 - q^2) sigma n_k with q = exp(-step/time)."""
        kept = jnp.exp(-self.step / self.correlation_time)
        fresh = jnp.sqrt(-jnp.expm1(-2 * self.step / self.correlation_time))
        noise = jax.random.normal(key, (self.samples, 3), dtype=self.mean.dtype)
        # Steps x -> kept x + news are associative, so that a parallel scan computes them.
        news = (fresh * noise).at[0].set(noise[0])
        after = lambda first, second: (first[0] * second[0], first[1] * second[0] + second[1])
        return self.deviation[None, :] * jax.lax.associative_scan(after, (jnp.full((self.samples, 1), kept), news))[1]

    def at(self, realization, t, pose, load: Load) -> Load:
        index = jnp.clip(t / self.step, 0.0, self.samples - 1.0)
        before = jnp.minimum(index.astype(int), self.samples - 2)
        share = index - before.astype(index.dtype)
        change = realization[before + 1] - realization[before]
        slope = jnp.where(t < self.step * (self.samples - 1), change / self.step, 0.0)
        return with_water(load, pose, self.mean + realization[before] + share * change, slope)

    def jumps(self, duration: float) -> tuple[float, ...]:
        times = float(self.step) * np.arange(1, self.samples)
        return tuple(times[times < duration].tolist())


def gauss_markov_current(
    mean=(0.3, 0.0, 0.0), deviation=(0.1, 0.1, 0.0), correlation_time=60.0, span: float = 600.0, step: float = 0.5
) -> GaussMarkovCurrent:
    """Random current about a mean, as in Fossen (2021), ch. 10.3; different for every seed.

    Args:
        mean: m/s: north, east, down.
        deviation: standard deviation of each, m/s.
        correlation_time: s.
        span: duration of the process, s; the current is constant afterwards.
        step: time between samples, s.
    """
    checks.positive("step", step, "s")
    checks.positive("span", span, "s")
    samples = round(span / step) + 1
    if not 2 <= samples <= _LONGEST:
        raise BadInput("span", f"be 1 to {_LONGEST - 1} steps of {step:g} s", f"{span:g} s")
    return GaussMarkovCurrent(mean, deviation, correlation_time, step, samples)
