"""Compass: heading."""

import jax.numpy as jnp

from undertow.sensors.estimate import Estimate, Motion
from undertow.sensors.sampling import Sampling
from undertow.sensors.sensor import AbstractSensor


class Compass(AbstractSensor):
    """Yaw, rad."""

    fixes = ("yaw",)

    def reading(self, motion: Motion):
        return motion.angles[2:]

    def correct(self, estimate: Estimate, reading) -> Estimate:
        now = reading + self.sampling.delay * estimate.rates[2]
        return estimate.turned(jnp.concatenate([estimate.angles()[:2], now]), self.blend)


def compass(
    period: float = 0.05,
    noise: float = 0.01,
    bias: float = 0.0,
    resolution: float = 0.0,
    delay: float = 0.0,
    dropout: float = 0.0,
    blend: float = 0.05,
) -> Compass:
    """Heading, from a magnetic or fibre-optic compass.

    Args:
        period: between samples, s.
        noise: standard deviation, rad.
        bias: standard deviation of a constant offset, sampled once per run, rad.
        resolution: step of the reading, rad; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
        blend: share of each new heading in the estimated one; the rest comes from the rates.
    """
    return Compass(Sampling(period, noise, bias, resolution, delay, dropout), blend)
