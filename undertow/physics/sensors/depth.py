"""Depth from pressure."""

from undertow.physics.sensors.gauss_markov import correlated_errors
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractSensor


class Depth(AbstractSensor):
    """Down, m. The sensor is at the body origin, and the pressure of waves is neglected."""

    fixes = ("down",)

    def reading(self, motion: Motion):
        return motion.position[2:]


def depth(
    period: float = 0.05,
    noise: float = 2e-3,
    bias: float = 0.0,
    resolution: float = 1e-3,
    delay: float = 0.0,
    dropout: float = 0.0,
    correlated_noise: float | None = None,
    correlation_time: float | None = None,
) -> Depth:
    """Depth below the surface, by a pressure sensor at the body origin.

    Args:
        period: between samples, s.
        noise: standard deviation, m.
        bias: standard deviation of a constant offset, sampled once per run, m.
        resolution: step of the reading, m; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
        correlated_noise: standard deviation of a further error of the depth, a first-order Gauss-Markov process, m.
        correlation_time: of it, s: time in which its correlation falls to 1/e.
    """
    errors = correlated_errors(correlated_noise, correlation_time)
    return Depth(Sampling(period, noise, bias, resolution, delay, dropout, errors=errors))
