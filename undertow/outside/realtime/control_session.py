"""When a controller starts, steps and waits, and what the vehicle gets meanwhile, whoever sets the pace."""

from collections.abc import Callable
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.link import LinkMeasurement
from undertow.outside.realtime.measurement_rate import MeasurementRate

SAFE_PERIOD = 0.1  # s between two safe outputs while the controller waits

_SECOND = 10**9  # ns
_EXACT = 2  # ns, within which stamps are one sampling time apart
_HOLDING = ("SAFE", "STOPPED")  # states of a supervisor in which the law has no say


class ControlSession:
    """One controller, from its first measurement to its last command.

    The loop's own clock calls `start` and `step`. Measurements that set the pace go through `follow`:

    * The controller starts with the first measurement whose numbers are all finite. Later, entries that are NaN were
      not measured: it takes what its model expects.
    * At most one step per sampling time: where measurements come more often, the ones nearest to that are taken.
    * It stops where no pose has come for `max_age`, where measurements come irregularly (`MeasurementRate`), and where
      the vehicle or its operator objects. The vehicle then gets the safe output, ten times per second.
    * It starts again with the next whole measurement: reference, law and output begin there, the output at the safe
      one. A supervisor that has stopped the law or holds a place goes on with that instead, for this is the operator's
      to end: by an objection, such as disarming, or by a new session.

    Args:
        autopilot: the controller.
        form: format of the link's measurements; None of a plant that is no vehicle.
        max_age: s.
        safe: the safe output, in the unit of the plant's input.
        from_safe: whether the first output of `follow` begins at the safe one, too, rather than at the law's.

    Attributes:
        running: whether the controller steps.
        counts: starts; measurements `between steps`; how often they became `irregular`.
    """

    def __init__(
        self, autopilot: Autopilot, form: Format | None, max_age: float, safe: np.ndarray, from_safe: bool = False
    ):
        self._autopilot, self._max_age, self._safe, self._from_safe = autopilot, max_age, safe, from_safe
        self._period = round(autopilot.sampling_time * _SECOND)
        self._nothing = _nothing_measured(autopilot, form)
        self._rate = MeasurementRate(autopilot.sampling_time)
        self.running = False
        self.counts = {"starts": 0, "between steps": 0, "irregular": 0}
        self._located = self._safe_sent = -np.inf  # s, when a pose came last, and when the safe output was sent
        self._stamp: int | None = None  # of the last measurement, ns
        self._stepped = 0  # stamp of the last step, ns
        self._operator_objected = False  # since the controller ran
        self._unfit = ""  # why the last measurement was none to start with

    def start(self, measurement: LinkMeasurement, applied: Any) -> np.ndarray:
        """The first command, which begins at an applied input; at the law's where that is None."""
        return self._given_to(self._autopilot.start, measurement, applied=applied)

    def step(self, measurement: LinkMeasurement | None, dt: float | None) -> np.ndarray:
        """The next command, for a measurement or without one, dt (s) after the last; None for the sampling time."""
        measured = self._nothing if measurement is None else measurement
        return self._given_to(self._autopilot.step, measured, applied=measured.applied, dt=dt)

    def _given_to(self, method: Callable[..., np.ndarray], measured: LinkMeasurement, **options: Any) -> np.ndarray:
        motion = measured.position, measured.velocity, measured.attitude
        options |= {"target": measured.target, "propellers": measured.propellers, "health": measured.health}
        return method(*motion, **options)

    def follow(self, measurement: LinkMeasurement | None, now: float, objection: str = "") -> np.ndarray | None:
        """The command that answers a measurement; None where there is none. Call it often, also without one.

        Args:
            measurement: of the present, with its stamp; None where none came.
            now: s, of the clock by which measurements grow old.
            objection: why the controller may not run; "" where it may.
        """
        self._stop_if_lost(now, objection)
        if measurement is None:
            return None
        before, self._stamp = self._stamp, measurement.stamp
        if measurement.elapsed == 0:
            self.running, before = False, None
        if before is not None:
            self._rate.note((measurement.stamp - before) / _SECOND, now)
            self.counts["irregular"] = self._rate.counted
        if measurement.has_pose:
            self._located = now
        self._stop_if_lost(now, objection)
        if self._rate.irregular or objection:
            return None
        if before is None or not self.running:
            command = self._begin(measurement)
            if command is None:
                return None
        elif self._is_between_steps(measurement.stamp, before):
            self.counts["between steps"] += 1
            return None
        else:
            command = self.step(measurement, self._passed(measurement))
        self._stepped = measurement.stamp
        self.running = True
        self._operator_objected = False
        return command

    def _stop_if_lost(self, now: float, objection: str) -> None:
        """Stop the controller where it may not run any more."""
        self._located = min(self._located, now)  # the clock of a simulation may be set back
        self._safe_sent = min(self._safe_sent, now)
        self._operator_objected |= bool(objection)
        lost = now - self._located > self._max_age or self._rate.irregular
        if self.running and (lost or objection):
            self.running = False
            self._safe_sent = -np.inf

    def is_safe_output_due(self, now: float) -> bool:
        """Whether the safe output should be sent now, which is noted: the controller has run, and waits."""
        due = self.counts["starts"] > 0 and not self.running and now - self._safe_sent >= SAFE_PERIOD
        if due:
            self._safe_sent = now
        return due

    def state(self, objection: str = "") -> str:
        """In words, what the controller does or waits for."""
        if objection:
            return objection
        if not self.running:
            return "irregular measurements" if self._rate.irregular else f"no valid measurement{self._unfit}"
        supervision = self._autopilot.supervision
        return f"running, {supervision}" if supervision else "running"

    def _begin(self, measurement: LinkMeasurement) -> np.ndarray | None:
        """The first command, or the first after a stop; None where the measurement is none to start with."""
        missing = measurement.missing()
        again = self.counts["starts"] > 0
        self._unfit = f": {missing} not measured" if missing else ""
        if missing:
            return None
        if again and self._holds_on():
            return self.step(measurement, self._passed(measurement))
        applied = self._safe
        if again and measurement.applied is not None:
            applied = measurement.applied
        try:
            command = self.start(measurement, applied if again or self._from_safe else None)
        except BadInput as error:
            self._unfit = f": {error}"
            return None
        self.counts["starts"] += 1
        return command

    def _holds_on(self) -> bool:
        """Whether a supervisor holds the vehicle and the operator has not objected since."""
        if self._operator_objected or not self._autopilot.supervised:
            return False
        state, reason = self._autopilot.state
        return state in _HOLDING or reason == "place_held"

    def _is_between_steps(self, stamp: int, before: int) -> bool:
        """Whether the next measurement will be nearer to a step than this one."""
        return stamp - self._stepped + (stamp - before) / 2 < self._period

    def _passed(self, measurement: LinkMeasurement) -> float | None:
        """Time since the last step, s; None for the sampling time, and where the clock of the sender was set."""
        elapsed = measurement.stamp - self._stepped
        was_set = measurement.elapsed == 0 or elapsed <= 0
        return None if was_set or abs(elapsed - self._period) <= _EXACT else elapsed / _SECOND


def _nothing_measured(autopilot: Autopilot, form: Format | None) -> LinkMeasurement:
    """What the autopilot is given without a measurement: it takes what its model expects."""
    outputs = len(autopilot.plant.outputs)
    if form is None:
        return LinkMeasurement(np.full(outputs, np.nan), np.full(outputs, np.nan))
    names = form.columns()
    unknown = lambda columns: np.full(len(columns), np.nan)
    return LinkMeasurement(unknown(names.position), unknown(names.velocity), unknown(names.attitude))
