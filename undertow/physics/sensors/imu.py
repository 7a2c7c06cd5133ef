"""Inertial measurement unit: roll and pitch, angular rates, specific force."""

import jax.numpy as jnp

from undertow.physics.sensors.gauss_markov import correlated_errors
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractVelocitySensor


class IMU(AbstractVelocitySensor):
    """Roll, pitch (rad), p, q, r (rad/s), specific force (m/s^2, body axes, the mean since the last step)."""

    fixes = ("roll", "pitch")
    angles = (0, 1)

    def reading(self, motion: Motion):
        return jnp.concatenate([motion.angles[:2], motion.rates, motion.specific_force])

    def velocity_noise(self):
        return jnp.full(6, jnp.inf).at[3:].set(self.sampling.noise[2:5])


def imu(
    period: float = 0.01,
    angle_noise: float = 5e-3,
    rate_noise: float = 2e-3,
    force_noise: float = 0.02,
    angle_bias: float = 0.0,
    rate_bias: float = 0.0,
    force_bias: float = 0.0,
    delay: float = 0.0,
    dropout: float = 0.0,
    correlated_angle_noise: float | None = None,
    correlation_time: float | None = None,
) -> IMU:
    """Gyroscopes, accelerometers and the inclination fused from them. Defaults are those of cheap MEMS devices.

    Args:
        period: between samples, s.
        angle_noise: standard deviation of roll and pitch, rad.
        rate_noise: of p, q and r, rad/s.
        force_noise: of the specific force, m/s^2.
        angle_bias: standard deviation of a constant offset of roll and pitch, sampled once per run, rad.
        rate_bias: likewise of p, q and r, rad/s.
        force_bias: likewise of the specific force, m/s^2; an error of roll of 0.01 rad acts like 0.1 m/s^2.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
        correlated_angle_noise: standard deviation of a further error of roll and pitch, a first-order Gauss-Markov
            process, rad.
        correlation_time: of it, s: time in which its correlation falls to 1/e.
    """
    noise = [angle_noise] * 2 + [rate_noise] * 3 + [force_noise] * 3
    bias = [angle_bias] * 2 + [rate_bias] * 3 + [force_bias] * 3
    errors = correlated_errors(correlated_angle_noise, correlation_time, 2, "correlated_angle_noise")
    return IMU(Sampling(period, noise, bias, delay=delay, dropout=dropout, errors=errors))
