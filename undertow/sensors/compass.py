"""Compass: heading."""

from undertow.sensors.motion import Motion
from undertow.sensors.sampling import Sampling
from undertow.sensors.sensor import AbstractSensor


class Compass(AbstractSensor):
    """Yaw, rad."""

    fixes = ("yaw",)
    angles = (0,)

    def reading(self, motion: Motion):
        return motion.angles[2:]


def compass(
    period: float = 0.05,
    noise: float = 0.01,
    bias: float = 0.0,
    resolution: float = 0.0,
    delay: float = 0.0,
    dropout: float = 0.0,
) -> Compass:
    """Heading, from a magnetic or fibre-optic compass.

    Args:
        period: between samples, s.
        noise: standard deviation, rad.
        bias: standard deviation of a constant offset, sampled once per run, rad.
        resolution: step of the reading, rad; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
    """
    return Compass(Sampling(period, noise, bias, resolution, delay, dropout))
