"""The contract of a sensor."""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Reading, Sampling


class AbstractSensor(eqx.Module):
    """A sensor: when it is read, and its reading of a motion. What is made of readings is up to the navigation filter.

    The filter may call `reading` with an estimated motion, to compare, and differentiate it.
    """

    sampling: Sampling
    # Outputs (north, east, down, roll, pitch, yaw) that it keeps from drifting; None where it does not say.
    fixes: ClassVar[tuple[str, ...] | None] = None
    angles: ClassVar[tuple[int, ...]] = ()  # entries of a reading that are angles, which may turn by 2 pi

    @abc.abstractmethod
    def reading(self, motion: Motion) -> Reading:
        """Reading without error, of one axis."""


class AbstractDisturbedSensor(AbstractSensor):
    """A sensor whose correlated errors depend on the motion, such as a compass in the field of its vehicle."""

    @abc.abstractmethod
    def error_slopes(self, motion: Motion) -> Float[Array, "width errors"]:
        """Slopes of a reading in the correlated errors of `sampling`.

        `motion.actuator` is None where a filter knows nothing of the actuators.
        """

    @abc.abstractmethod
    def check(self, motion: Motion) -> None:
        """Check that a true motion has what disturbs this sensor.

        Raises:
            BadInput: it has not.
        """


class AbstractVelocitySensor(AbstractSensor):
    """A sensor that reads velocities or rates of turn."""

    @abc.abstractmethod
    def velocity_noise(self) -> Float[Array, "6"]:
        """Standard deviation of each reading of u, v, w (m/s), p, q, r (rad/s); infinite for entries that it lacks."""


def error_slopes(sensor: AbstractSensor, motion: Motion) -> Float[Array, "width errors"]:
    """Slopes of a reading in the correlated errors of a sensor: each is added to one entry unless it says otherwise."""
    if isinstance(sensor, AbstractDisturbedSensor):
        return sensor.error_slopes(motion)
    assert sensor.sampling.errors is not None
    return jnp.eye(len(sensor.reading(motion)), len(sensor.sampling.errors.deviation))
