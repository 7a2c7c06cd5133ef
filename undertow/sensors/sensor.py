"""The contract of a sensor."""

import abc
from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.sensors.estimate import Estimate, Motion
from undertow.sensors.sampling import Reading, Sampling


class AbstractSensor(eqx.Module):
    """A sensor: its reading of the motion, and how a reading corrects the estimate.

    Raises:
        BadInput: a blend outside (0, 1].
    """

    sampling: Sampling
    blend: Float[Param, ""] = param("", "share of each new reading in the estimate")
    # Outputs (north, east, down, roll, pitch, yaw) that it keeps from drifting; None where it does not say.
    fixes: ClassVar[tuple[str, ...] | None] = None

    def __check_init__(self):
        checks.positive("blend", self.blend)
        if not checks.assumed(lambda share: (share <= 1).all(), self.blend):
            raise BadInput("blend", "be at most 1", f"{float(self.blend):g}")

    @abc.abstractmethod
    def reading(self, motion: Motion) -> Reading:
        """Reading without error."""

    @abc.abstractmethod
    def correct(self, estimate: Estimate, reading: Reading) -> Estimate:
        """Estimate corrected by a reading that was taken `sampling.delay` ago; called after the prediction."""


class AbstractVelocitySensor(AbstractSensor):
    """A sensor that reads velocities or rates of turn."""

    @abc.abstractmethod
    def velocity_noise(self) -> Float[Array, "6"]:
        """Standard deviation of each reading of u, v, w (m/s), p, q, r (rad/s); infinite for entries that it lacks."""
