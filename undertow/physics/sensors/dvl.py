"""Doppler velocity log: velocity over the ground, in body axes."""

import jax.numpy as jnp

from undertow.core.numerics.linear_algebra import matvec
from undertow.physics.sensors.gauss_markov import correlated_errors
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractVelocitySensor


class DVL(AbstractVelocitySensor):
    """u, v, w over the ground, m/s."""

    fixes = ()

    def reading(self, motion: Motion):
        return matvec(motion.rotation.T, motion.velocity)

    def velocity_noise(self):
        return jnp.full(6, jnp.inf).at[:3].set(self.sampling.noise)


def dvl(
    period: float = 0.125,
    noise: float = 5e-3,
    bias: float = 0.0,
    resolution: float = 1e-3,
    delay: float = 0.05,
    dropout: float = 0.0,
    correlated_noise: float | None = None,
    correlation_time: float | None = None,
) -> DVL:
    """Velocity over the ground from four acoustic beams. Defaults are those of a small device near the bottom.

    Args:
        period: between pings, s; it grows with the distance to the bottom.
        noise: standard deviation of each component, m/s.
        bias: standard deviation of a constant offset, sampled once per run, m/s.
        resolution: step of the reading, m/s; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a ping finds no bottom.
        correlated_noise: standard deviation of a further error of each component, a first-order Gauss-Markov process,
            m/s.
        correlation_time: of it, s: time in which its correlation falls to 1/e.
    """
    errors = correlated_errors(correlated_noise, correlation_time, 3)
    return DVL(Sampling(period, noise, bias, resolution, delay, dropout, errors=errors))
