"""What the real-time loop knows of a vehicle: measurements come from a link, commands go to it."""

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.outside.autopilot.measured_motion import Format

_MEASURED = ("position", "velocity", "attitude", "propellers")


class LinkMeasurement(NamedTuple):
    """A measurement, with what belongs to it; arguments of `Autopilot.step`.

    Attributes:
        position, velocity, attitude: measured motion, in the format of the link; NaN for what was not measured.
        propellers: what the thrusters reported; None without it.
        health: of the actuators; None without it.
        applied: input applied since the last measurement, in the unit of the plant's input; None where it is unknown.
        target: to follow in this step; None for the scenario's reference.
        elapsed: time since the last step, s, where the link knows it better than the loop; 0 begins again, as where the
            vehicle's clock was set or its estimate of the motion began anew.
        stamp: time of the measurement by the clock of its sender, ns; of links that set the pace.
    """

    position: Any
    velocity: Any
    attitude: Any = ()
    propellers: Any = None
    health: Any = None
    applied: Any = None
    target: Any = None
    elapsed: float | None = None
    stamp: int = 0

    @property
    def has_pose(self) -> bool:
        """Whether position and attitude were measured."""
        return bool(np.isfinite(self.position).all() and np.isfinite(self.attitude).all())

    def missing(self) -> str:
        """Which parts have numbers that were not measured; "" for none: then a controller can start."""
        return ", ".join(name for name in _MEASURED if not _is_finite(getattr(self, name)))


def _is_finite(part: Any) -> bool:
    return all(np.isfinite(numbers).all() for numbers in jax.tree.leaves(part))


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


class AbstractPacingLink(AbstractLink):
    """A link that sets the pace: the controller steps when a measurement comes, by its stamp.

    It returns measurements of the present only: older ones, repeated ones and those out of order are counted instead.
    """

    @abc.abstractmethod
    def wait(self, longest: float) -> None:
        """Wait until something has come, at most so long, s; what is due without that is sent meanwhile."""

    @abc.abstractmethod
    def discard(self) -> None:
        """Forget what has come so far: it is old, because the loop stood still."""

    def time(self, now: float) -> float:
        """Time by which measurements grow old, s, at `now` of the loop's clock; another one of a simulated vehicle."""
        return now

    def objection(self) -> str:
        """Why the vehicle or its operator lets no controller run now; "" where one may."""
        return ""

    def note_begin(self) -> None:
        """Called before the first command of a controller that starts, or starts again."""

    def note_stop(self, reason: str) -> None:
        """Called when a controller stops that may start again; the safe output follows."""

    def complaints(self) -> list[str]:
        """Sentences about what the operator should know, for the status line."""
        return []
