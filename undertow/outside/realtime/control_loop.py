"""The real-time loop: it steps a controller over a link to the vehicle, with a safe output at the end.

By its own clock it takes one step per period, under a deadline. Step n is planned for n periods after the start. In
each step the loop receives the newest measurement, computes, and sends one command. Then it waits for the next whole
period that has not begun: a period whose beginning was missed has no step of its own, so that no period ever has two
commands. The controller gets the time since its last step. A step that begins up to a tenth of a period late counts as
on time there, so that jitter of the machine is not passed on.

Where the link sets the pace, a step is taken when a measurement comes, by the rules of `ControlSession`.
"""

import contextlib
import gc
import math
from collections.abc import Callable, Iterator

import numpy as np

from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.realtime.control_session import ControlSession
from undertow.outside.realtime.link import AbstractLink, AbstractPacingLink, LinkMeasurement
from undertow.outside.realtime.loop_clock import AbstractLoopClock
from undertow.outside.realtime.loop_settings import LoopSettings, Reason
from undertow.outside.realtime.loop_statistics import LoopStatistics

_LITTLE = 0.1  # periods, by which a step may begin late and counts as on time for the controller
_ROUNDING = 1e-6  # periods
_STANDSTILL = 2.0  # periods, that a loop of long periods may stand still beyond `max_age`
LOOK = 0.05  # s, longest wait for a measurement that sets the pace, before other things are looked after


class RealTimeLoop:
    """Steps an autopilot at its sampling time, with a link to the vehicle.

    Args:
        autopilot: whose format is that of the link, and whose output is the input of the plant.
        link: it is finished by `run`.
        clock: the only clock that is used.
        settings: None for the usual ones.
        stop: asked once per step, or twenty times per second; the loop ends when it says so.
        begun: called once, when the first measurement of a loop by its own clock has come.
        report: gets a line once per second, of a loop by measurements.
        every: s between these lines.

    Attributes:
        session: its rules.
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
        report: Callable[[str], None] = lambda line: None,
        every: float = 1.0,
    ):
        self._autopilot, self._link, self._clock, self._stop, self._begun = autopilot, link, clock, stop, begun
        self._report, self._every = report, every
        self._report_due = clock.now() + every
        self._steps_reported = 0
        self._last_look: float | None = None  # when measurements were looked for last, s
        self._period = autopilot.sampling_time
        loop_settings = LoopSettings() if settings is None else settings
        self._settings = loop_settings.checked(autopilot.plant.inputs())
        self._deadline = self._period if loop_settings.deadline is None else loop_settings.deadline
        self._standstill = max(loop_settings.max_age, _STANDSTILL * self._period)
        safe = self._settings.safe
        self.session = ControlSession(autopilot, link.form, loop_settings.max_age, safe, loop_settings.from_safe)
        self.statistics = LoopStatistics()

    def run(self, steps: float = math.inf, periods: float = math.inf) -> Reason:
        """Take steps until so many are taken, so many periods are over, the link ends or is silent, or `stop` says so.

        A loop whose link sets the pace waits where that is silent. Whatever happens, the last thing sent is the safe
        output.
        """
        try:
            self._link.guard(self._settings.safe, self._standstill)
            if isinstance(self._link, AbstractPacingLink):
                return self._by_measurements(self._link, steps, periods)
            with _without_collection():
                return self._by_clock(steps, periods)
        finally:
            self._link.finish(self._settings.safe)

    def _by_clock(self, steps: float, periods: float) -> Reason:
        received = self._first_measurement()
        if received is None:
            return self._why_no_start()
        self._begun()
        clock, period, statistics = self._clock, self._period, self.statistics
        loop_start = started = last = clock.now()
        planned, instant, elapsed, waited = 0, 0.0, 0.0, 0.0
        while True:
            computing_start = clock.now()
            self._link.send(self._command(received, elapsed))
            command_sent = clock.now()
            self._autopilot.log_step()  # after the command is on its way
            following = max(planned + 1, math.floor((clock.now() - loop_start) / period) + 1)
            self._count(command_sent - loop_start - planned * period, following - planned - 1, received is not None)
            statistics.computing.add(command_sent - computing_start)
            statistics.lateness.add(started - loop_start - planned * period)
            statistics.longest_stale = max(statistics.longest_stale, waited)
            if statistics.steps > 1 and started - last < 1.5 * period:
                statistics.jitter.add(abs(started - last - period))
            if statistics.steps >= steps or planned + 1 >= periods:
                return Reason.COMPLETED

            planned, last = following, started
            clock.sleep_until(loop_start + planned * period)
            if self._stop():
                return Reason.STOPPED
            started = clock.now()
            before = instant
            instant = self._instant(started - loop_start)
            elapsed = (instant - before) * period
            if elapsed > self._standstill:
                return Reason.STALLED
            received = self._link.receive(elapsed)
            if self._link.ended:
                return Reason.LINK_ENDED
            waited = 0.0 if received is not None else waited + elapsed
            if waited > self._settings.max_age:
                return Reason.LINK_LOST

    def _count(self, response_time: float, missed: int, fresh: bool) -> None:
        """Count a step whose command came `response_time` (s) after its planned beginning."""
        statistics = self.statistics
        statistics.steps += 1
        statistics.overruns += response_time >= self._deadline
        statistics.missed += missed
        statistics.stale += not fresh

    def _instant(self, since: float) -> float:
        """Time of a step that begins `since` (s) after the start, as the controller gets it, in periods."""
        periods = since / self._period
        whole_periods = math.floor(periods + _ROUNDING)
        return whole_periods if periods - whole_periods <= _LITTLE else periods

    def _command(self, received: LinkMeasurement | None, elapsed: float) -> np.ndarray:
        """The command for a measurement, or without one."""
        if received is not None and (self.statistics.steps == 0 or received.elapsed == 0):
            return self.session.start(received, received.applied)
        dt = elapsed if received is None or received.elapsed is None else received.elapsed
        return self.session.step(received, dt)

    def _first_measurement(self) -> LinkMeasurement | None:
        """Wait for the first measurement whose entries are all finite; None where none came, or the loop was stopped.

        The safe output is sent meanwhile.
        """
        wait_start = self._clock.now()
        planned = 0
        while not self._stop() and not self._link.ended:
            received = self._link.receive(self._period if planned else 0.0)
            if received is not None and not received.missing():
                return received
            if self._clock.now() - wait_start > self._settings.patience:
                return None
            self._link.await_measurement(self._settings.safe)
            planned += 1
            self._clock.sleep_until(wait_start + planned * self._period)
        return None

    def _why_no_start(self) -> Reason:
        if self._link.ended:
            return Reason.LINK_ENDED
        return Reason.STOPPED if self._stop() else Reason.NO_START

    def _by_measurements(self, link: AbstractPacingLink, steps: float, periods: float) -> Reason:
        loop_start = self._clock.now()
        while not self._stop():
            self.turn(link, LOOK)
            if self.statistics.steps >= steps or self._clock.now() - loop_start >= periods * self._period:
                return Reason.COMPLETED
            if link.ended:
                return Reason.LINK_ENDED
            self._report_if_due(link)
        return Reason.STOPPED

    def turn(self, link: AbstractPacingLink, longest: float) -> None:
        """Wait at most so long (s) for a measurement and answer it, or send the safe output where that is due."""
        link.wait(longest)
        now = link.time(self._clock.now())
        elapsed = now - (now if self._last_look is None else self._last_look)
        self._last_look = now
        if elapsed > self._standstill + LOOK:
            link.discard()
        computing_start = self._clock.now()
        was_running = self.session.running
        measurement = link.receive(elapsed)
        objection = link.objection()
        command = self.session.follow(measurement, now, objection)
        if command is not None:
            if not was_running:
                link.note_begin()
            self.statistics.steps += 1  # whoever sees the command sees it counted
            link.send(command)
            self.statistics.computing.add(self._clock.now() - computing_start)
            self._autopilot.log_step()
        elif was_running and not self.session.running:
            link.note_stop(self.session.state(objection))
        if self.session.is_safe_output_due(now):
            link.send(self._settings.safe)

    def _report_if_due(self, link: AbstractPacingLink) -> None:
        now = self._clock.now()
        if now >= self._report_due:
            rate = (self.statistics.steps - self._steps_reported) / self._every
            self._report(self.status_line(link, rate))
            self._steps_reported, self._report_due = self.statistics.steps, now + self._every

    def status_line(self, link: AbstractPacingLink, rate: float) -> str:
        """What is going on, in one line; `rate` is that of the steps, Hz."""
        return "; ".join([self.session.state(link.objection()), f"{rate:.0f} Hz", self.counts_line(link)])

    def counts_line(self, link: AbstractPacingLink) -> str:
        """Times of the steps, what happened so far, and what the operator should know."""
        timing = self._autopilot.counts
        counts = {**link.counts(), **self.session.counts, "late": timing["late"], "missed": timing["missed"]}
        numbers = [f"{name} {number}" for name, number in counts.items() if number]
        return "; ".join([f"step {self.statistics.computing}", *numbers, *link.complaints()])


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
