"""Position fixes: acoustic positioning (USBL, LBL), or a satellite receiver at the surface."""

from undertow.physics.sensors.gauss_markov import correlated_errors
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractSensor


class PositionFix(AbstractSensor):
    """North and east, m."""

    fixes = ("north", "east")

    def reading(self, motion: Motion):
        return motion.position[:2]


def position_fix(
    period: float = 1.0,
    noise: float = 0.05,
    bias: float = 0.0,
    resolution: float = 0.0,
    delay: float = 0.2,
    dropout: float = 0.0,
    correlated_noise: float | None = None,
    correlation_time: float | None = None,
) -> PositionFix:
    """North and east at a low rate.

    Args:
        period: between fixes, s.
        noise: standard deviation of each, m.
        bias: standard deviation of a constant offset, sampled once per run, m.
        resolution: step of the reading, m; 0 for none.
        delay: until a fix is delivered, s.
        dropout: probability that a fix is lost.
        correlated_noise: standard deviation of a further error of each, a first-order Gauss-Markov process, m.
        correlation_time: of it, s: time in which its correlation falls to 1/e.
    """
    errors = correlated_errors(correlated_noise, correlation_time, 2)
    return PositionFix(Sampling(period, noise, bias, resolution, delay, dropout, errors=errors))
