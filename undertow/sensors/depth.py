"""Depth from pressure."""

from undertow.sensors.estimate import Estimate, Motion
from undertow.sensors.sampling import Sampling
from undertow.sensors.sensor import AbstractSensor

_DOWN = slice(2, 3)


class Depth(AbstractSensor):
    """Down, m. The sensor is at the body origin, and the pressure of waves is neglected."""

    fixes = ("down",)

    def reading(self, motion: Motion):
        return motion.position[_DOWN]

    def correct(self, estimate: Estimate, reading) -> Estimate:
        return estimate.fixed(_DOWN, reading, self.sampling, self.blend)


def depth(
    period: float = 0.05,
    noise: float = 2e-3,
    bias: float = 0.0,
    resolution: float = 1e-3,
    delay: float = 0.0,
    dropout: float = 0.0,
    blend: float = 0.2,
) -> Depth:
    """Depth below the surface, by a pressure sensor at the body origin.

    Args:
        period: between samples, s.
        noise: standard deviation, m.
        bias: standard deviation of a constant offset, sampled once per run, m.
        resolution: step of the reading, m; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
        blend: alpha of the alpha-beta filter of the estimate.
    """
    return Depth(Sampling(period, noise, bias, resolution, delay, dropout), blend)
