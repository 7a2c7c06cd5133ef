"""Propeller speeds, reported by sensorless drives or encoders."""

from undertow.core.errors import BadInput
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractSensor


class PropellerSpeed(AbstractSensor):
    """Speed of every propeller, rad/s.

    Raises:
        BadInput: the thrusters have no speed that could be measured.
    """

    fixes = ()

    def reading(self, motion: Motion):
        if motion.actuator is None:
            hint = "Take fidelity: shaft or electromechanical, on which it is reported, or leave propeller_speed out"
            raise BadInput("propeller_speed", "have propellers that turn", "thrusters without a speed", hint=hint)
        return motion.actuator.speed


def propeller_speed(
    period: float = 0.01,
    noise: float = 0.5,
    bias: float = 0.0,
    resolution: float = 0.0,
    delay: float = 0.0,
    dropout: float = 0.0,
) -> PropellerSpeed:
    """Speeds of all propellers.

    Args:
        period: between samples, s; not shorter than the sampling time of the loop.
        noise: standard deviation, rad/s.
        bias: standard deviation of a constant offset, sampled once per run, rad/s.
        resolution: step of the reading, rad/s; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
    """
    return PropellerSpeed(Sampling(period, noise, bias, resolution, delay, dropout))
