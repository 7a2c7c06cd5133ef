"""How a real-time loop runs, and why it ended."""

import enum
from typing import Any, NamedTuple

import numpy as np

from undertow.core import checks
from undertow.core.checks import numbers


class Reason(enum.Enum):
    """Why a loop ended."""

    COMPLETED = "completed"
    LINK_ENDED = "the link ended"
    LINK_LOST = "no measurement"
    NO_START = "no first measurement"
    STALLED = "the controller stood still"
    STOPPED = "stopped"


class LoopSettings(NamedTuple):
    """How a loop runs.

    Attributes:
        safe: output that is sent last, however the loop ends, and while the controller waits; in the unit of the
            plant's input, one number or one per actuator.
        deadline: s after the planned beginning of a step, by which its command should be sent; None for the period.
        max_age: s without a new measurement, or without a step of its own, after which a loop ends that goes by its own
            clock, and the controller of another one waits.
        patience: s that a loop by its own clock waits for the first measurement.
        from_safe: whether the first output of a loop by measurements begins at the safe one.
    """

    safe: Any = 0.0
    deadline: float | None = None
    max_age: float = 0.5
    patience: float = 10.0
    from_safe: bool = False

    def checked(self, inputs: int) -> "LoopSettings":
        """These settings with a safe output per actuator.

        Raises:
            BadInput: a setting cannot be used.
        """
        if self.deadline is not None:
            checks.positive("deadline", self.deadline, "s")
        checks.positive("max_age", self.max_age, "s")
        checks.positive("patience", self.patience, "s")
        safe = self.safe if np.ndim(self.safe) > 0 else np.full(inputs, self.safe)
        safe = numbers("safe", safe, (inputs,))
        checks.finite("safe", safe)
        return self._replace(safe=safe)
