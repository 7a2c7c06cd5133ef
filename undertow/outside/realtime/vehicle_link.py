"""The vehicle of a scenario in the same process, with its navigation, disturbances and faults, as a link."""

import numpy as np

from undertow.core.checks import numbers
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.outside.realtime.link import AbstractLink, LinkMeasurement
from undertow.scenario.build import Built


class VehicleLink(AbstractLink):
    """The vehicle, or another plant, of a scenario. It moves when a measurement is asked for, by the time since then.

    Steps of the length of the scenario's sampling time have the bits of `undertow simulate`, where the batch compiler
    knows all parts (`backend`).

    Args:
        built: a scenario with a sampled loop.

    Attributes:
        backend: `simd` or `xla`.

    Raises:
        BadInput: the loop is continuous.
    """

    def __init__(self, built: Built):
        if built.scenario.loop.kind != "sampled":
            raise BadInput("loop.kind", "be sampled", built.scenario.loop.kind)
        self._vehicle = Vehicle(built, attitude="both", velocity="both")
        self.backend = self._vehicle.backend
        self.form = Format("both", "both") if len(self._vehicle.output.attitude) else None
        self._command = np.zeros(self._vehicle.thrusters)
        self._began = False
        self._sent = 0

    @property
    def time(self) -> float:
        """s since the start, as a simulation counts it."""
        return self._vehicle.time

    def receive(self, elapsed: float) -> LinkMeasurement:
        if self._began and elapsed > 0 and not self.ended:
            self._move(elapsed)
        self._began = True
        return LinkMeasurement(**self._vehicle.output.measurement())

    def _move(self, elapsed: float) -> None:
        """Hold the command for a time, s; a failed vehicle stays where it is."""
        status = self._vehicle.step(self._command, elapsed).status
        if status is not Status.OK:
            self.ended = f"the vehicle failed at {self.time:.4g} s: {status.sentence}"
            self.failed = True

    def send(self, command: np.ndarray) -> None:
        self._command, self._sent = numbers("command", command, self._command.shape).copy(), self._sent + 1

    def finish(self, safe: np.ndarray) -> None:
        self.send(safe)

    @property
    def last_command(self) -> np.ndarray:
        """The command that was sent last."""
        return self._command.copy()

    def counts(self) -> dict[str, int]:
        return {"commands": self._sent}
