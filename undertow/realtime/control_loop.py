"""The real-time loop: one control step per period, under a deadline, with a safe output at the end.

Step n is planned for n periods after the start. In each step the loop receives the newest measurement, computes, and
sends one command. Then it waits for the next whole period that has not begun: a period whose beginning was missed has
no step of its own, so that no period ever has two commands. The controller gets the time since its last step. A step
that begins up to a tenth of a period late counts as on time there, so that jitter of the machine is not passed on.
"""

import contextlib
import enum
import gc
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.autopilot.autopilot import Autopilot
from undertow.core import checks
from undertow.core.checks import numbers
from undertow.realtime.link import AbstractLink, LinkMeasurement
from undertow.realtime.loop_clock import AbstractLoopClock
from undertow.realtime.statistics import LoopStatistics

_LITTLE = 0.1  # periods, by which a step may begin late and counts as on time for the controller
_ROUNDING = 1e-6  # periods
_STANDSTILL = 2.0  # periods, that a loop of long periods may stand still beyond `max_age`


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
        safe: output that is sent last, however the loop ends, in the unit of the plant's input; one number or one per
            actuator.
        deadline: s after the planned beginning of a step, by which its command should be sent; None for the period.
        max_age: s without a new measurement, or without a step of its own, after which the loop ends.
        patience: s that the loop waits for the first measurement.
    """

    safe: Any = 0.0
    deadline: float | None = None
    max_age: float = 0.5
    patience: float = 10.0


class RealTimeLoop:
    """Steps an autopilot at its sampling time, with a link to the vehicle.

    Args:
        autopilot: whose format is that of the link, and whose output is the input of the plant.
        link: it is finished by `run`.
        clock: the only clock that is used.
        settings: None for the usual ones.
        stop: asked once per step; the loop ends when it says so.
        begun: called once, when the first measurement has come.

    Attributes:
        statistics: of the steps so far.

    Raises:
        BadInput: a setting cannot be used.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        link: AbstractLink,
        clock: AbstractLoopClock,
        settings: LoopSettings | None = None,
        stop: Callable[[], bool] = lambda: False,
        begun: Callable[[], None] = lambda: None,
    ):
        settings = LoopSettings() if settings is None else settings
        self._autopilot, self._link, self._clock, self._stop, self._begun = autopilot, link, clock, stop, begun
        self._period = autopilot.sampling_time
        self._deadline = self._period if settings.deadline is None else settings.deadline
        checks.positive("deadline", self._deadline, "s")
        checks.positive("max_age", settings.max_age, "s")
        checks.positive("patience", settings.patience, "s")
        inputs = autopilot.plant.inputs()
        several = np.ndim(settings.safe) > 0
        given = settings.safe if several else np.full(inputs, settings.safe)
        self._safe = numbers("safe", given, (inputs,))
        checks.finite("safe", self._safe)
        self._max_age, self._patience = settings.max_age, settings.patience
        self._standstill = max(settings.max_age, _STANDSTILL * self._period)
        self._missing = self._nothing()
        self.statistics = LoopStatistics()

    def _nothing(self) -> LinkMeasurement:
        """What the autopilot is given without a measurement: it takes what its model expects."""
        form, outputs = self._link.form, len(self._autopilot.plant.outputs)
        if form is None:
            return LinkMeasurement(np.full(outputs, np.nan), np.full(outputs, np.nan))
        names, unknown = form.columns(), lambda columns: np.full(len(columns), np.nan)
        return LinkMeasurement(unknown(names.position), unknown(names.velocity), unknown(names.attitude))

    def run(self, steps: float = math.inf, periods: float = math.inf) -> Reason:
        """Take steps until so many are taken, so many periods are over, the link ends or is silent, or `stop` says so.

        Whatever happens, the last thing sent is the safe output.
        """
        try:
            self._link.guard(self._safe, self._standstill)
            with _without_collection():
                return self._run(steps, periods)
        finally:
            self._link.finish(self._safe)

    def _run(self, steps: float, periods: float) -> Reason:
        received = self._first_measurement()
        if received is None:
            return self._why_no_start()
        self._begun()
        clock, period, seen = self._clock, self._period, self.statistics
        begin = started = last = clock.now()
        planned, at, elapsed, waited = 0, 0.0, 0.0, 0.0
        while True:
            begun = clock.now()
            self._link.send(self._step(received, elapsed, seen.steps == 0))
            answered = clock.now()
            self._autopilot.log_step()  # after the command is on its way
            following = max(planned + 1, math.floor((clock.now() - begin) / period) + 1)
            self._count(answered - begin - planned * period, following - planned - 1, received is not None)
            seen.computing.add(answered - begun)
            seen.lateness.add(started - begin - planned * period)
            seen.longest_stale = max(seen.longest_stale, waited)
            if seen.steps > 1 and started - last < 1.5 * period:
                seen.jitter.add(abs(started - last - period))
            if seen.steps >= steps or planned + 1 >= periods:
                return Reason.COMPLETED

            planned, last = following, started
            clock.sleep_until(begin + planned * period)
            if self._stop():
                return Reason.STOPPED
            started = clock.now()
            before, at = at, self._instant(started - begin)
            elapsed = (at - before) * period
            if elapsed > self._standstill:
                return Reason.STALLED
            received = self._link.receive(elapsed)
            if self._link.ended:
                return Reason.LINK_ENDED
            waited = 0.0 if received is not None else waited + elapsed
            if waited > self._max_age:
                return Reason.LINK_LOST

    def _count(self, answered: float, missed: int, fresh: bool) -> None:
        """Count a step whose command came `answered` (s) after its planned beginning."""
        seen = self.statistics
        seen.steps += 1
        seen.overruns += answered >= self._deadline
        seen.missed += missed
        seen.stale += not fresh

    def _instant(self, since: float) -> float:
        """Time of a step that begins `since` (s) after the start, as the controller gets it, in periods."""
        periods = since / self._period
        whole = math.floor(periods + _ROUNDING)
        return whole if periods - whole <= _LITTLE else periods

    def _step(self, received: LinkMeasurement | None, elapsed: float, first: bool) -> np.ndarray:
        """The command for a measurement, or without one."""
        given = self._missing if received is None else received
        more = {"target": given.target, "applied": given.applied, "propellers": given.propellers}
        dt = elapsed if given.elapsed is None else given.elapsed
        motion = (given.position, given.velocity, given.attitude)
        if first or given.elapsed == 0:
            return self._autopilot.start(*motion, **more, health=given.health)
        return self._autopilot.step(*motion, **more, health=given.health, dt=dt)

    def _first_measurement(self) -> LinkMeasurement | None:
        """Wait for the first measurement whose entries are all finite; None where none came, or the loop was stopped.

        The safe output is sent meanwhile.
        """
        begin, planned = self._clock.now(), 0
        while not self._stop() and not self._link.ended:
            received = self._link.receive(self._period if planned else 0.0)
            if received is not None and _all_finite(received):
                return received
            if self._clock.now() - begin > self._patience:
                return None
            self._link.await_measurement(self._safe)
            planned += 1
            self._clock.sleep_until(begin + planned * self._period)
        return None

    def _why_no_start(self) -> Reason:
        if self._link.ended:
            return Reason.LINK_ENDED
        return Reason.STOPPED if self._stop() else Reason.NO_START


def _all_finite(received: LinkMeasurement) -> bool:
    given = (received.position, received.velocity, received.attitude, received.propellers)
    return all(np.isfinite(one).all() for one in jax.tree.leaves(given))


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Without the garbage collector, whose pauses are as long as the number of objects that live is large.

    What exists is left out of all collections; a step leaves no cycles behind, so that nothing accumulates.
    """
    enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if enabled:
            gc.enable()
