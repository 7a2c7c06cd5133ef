"""What the real-time loop knows of a vehicle: measurements come from a link, commands go to it."""

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from undertow.autopilot.measured_motion import Format


class LinkMeasurement(NamedTuple):
    """A measurement, with what belongs to it; arguments of `Autopilot.step`.

    Attributes:
        position, velocity, attitude: measured motion, in the format of the link.
        propellers: what the thrusters reported; None without it.
        health: of the actuators; None without it.
        applied: input applied since the last measurement, in the unit of the plant's input; None where it is unknown.
        target: to follow in this step; None for the scenario's reference.
        elapsed: time since the last step, s, where the link knows it better than the loop; 0 begins again.
    """

    position: Any
    velocity: Any
    attitude: Any = ()
    propellers: Any = None
    health: Any = None
    applied: Any = None
    target: Any = None
    elapsed: float | None = None


class AbstractLink(abc.ABC):
    """A vehicle, a network or a log, as the loop uses it.

    Attributes:
        form: format of the measured motions; None of a plant that is no vehicle.
        ended: why there is nothing more to receive; "" while there may be.
        failed: whether that end is a failure.
    """

    form: Format | None
    ended: str = ""
    failed: bool = False

    @abc.abstractmethod
    def receive(self, elapsed: float) -> LinkMeasurement | None:
        """The newest measurement that has not been received yet; None without one. It does not wait.

        Args:
            elapsed: time since the loop asked last, s, by the loop's clock.
        """

    @abc.abstractmethod
    def send(self, command: np.ndarray) -> None:
        """Send an input, in the unit of the plant's input. A network that does not take it is counted, not raised."""

    @abc.abstractmethod
    def finish(self, safe: np.ndarray) -> None:
        """Send the safe output as the last command, then close."""

    def guard(self, safe: np.ndarray, longest: float) -> None:  # noqa: B027
        """Called before the loop: a network sees to it that the vehicle gets the safe output whatever happens here.

        Args:
            safe: in the unit of the plant's input.
            longest: s for which the loop may stand still.
        """

    def await_measurement(self, safe: np.ndarray) -> None:  # noqa: B027
        """Called once per period while the loop waits for the first measurement: a network says that it is there."""

    @abc.abstractmethod
    def counts(self) -> Mapping[str, int]:
        """What happened on the link so far, by name."""
