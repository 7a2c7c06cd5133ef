"""When a controller starts, steps, waits and starts again, with measurements that set the pace."""

import re

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.control_loop import LOOK, RealTimeLoop
from undertow.outside.realtime.control_session import SAFE_PERIOD, ControlSession
from undertow.outside.realtime.link import AbstractPacingLink, LinkMeasurement
from undertow.outside.realtime.loop_clock import SimulatedClock
from undertow.outside.realtime.loop_settings import LoopSettings, Reason
from undertow.outside.realtime.measurement_rate import MOST

PERIOD, MAX_AGE, MILLISECOND = 0.01, 0.5, 1_000_000
FORM, SAFE, APPLIED = Format("quaternion", "body"), np.array([0.25, -0.5]), np.array([3.0, 4.0])


class TwoThrusters:
    outputs = ("position",)

    def inputs(self):
        return 2


class Noting:
    """A controller that notes how it was called, with a supervisor whose state is given."""

    sampling_time, plant, supervised, counts = PERIOD, TwoThrusters(), True, {"late": 0, "missed": 0}

    def __init__(self):
        self.calls, self.state, self.refuses = [], ("ACTIVE", ""), False

    @property
    def supervision(self):
        return self.state[0]

    def start(self, *motion, applied, **more):
        if self.refuses:
            raise BadInput("start", "lead to a finite command", "one that is not")
        self.calls.append(("start", None if applied is None else list(applied)))
        return np.ones(2)

    def step(self, *motion, dt, **more):
        self.calls.append(("step", dt))
        return np.ones(2)

    def log_step(self):
        pass


class Session(ControlSession):
    """With the time of the measurements, s, as that of the loop."""

    def __init__(self, from_safe=False):
        self.autopilot = Noting()
        super().__init__(self.autopilot, FORM, MAX_AGE, SAFE, from_safe)

    def at(self, time, objection="", position=(0.0, 0.0, 0.0), **more):
        """The call that a measurement leads to; None for none."""
        before = len(self.autopilot.calls)
        motion = np.array(position), np.zeros(6), np.array([1.0, 0, 0, 0])
        measured = LinkMeasurement(*motion, applied=APPLIED, stamp=round(time * 1e9), **more)
        answered = self.follow(measured, time, objection) is not None
        assert len(self.autopilot.calls) == before + answered
        return self.autopilot.calls[-1] if answered else None


@pytest.mark.parametrize("from_safe, first", [(False, None), (True, list(SAFE))])
def test_steps_follow_the_stamps(from_safe, first):
    session = Session(from_safe)
    assert [session.at(5 + k * PERIOD) for k in range(3)] == [("start", first), ("step", None), ("step", None)]
    kind, dt = session.at(5.035)
    assert kind == "step" and dt == pytest.approx(0.015)


def test_measurements_between_steps_are_left_out():
    """Four times as often: every fourth is a step, and one that comes late is at once."""
    session = Session()
    taken = [k for k in range(41) if session.at(1 + k * PERIOD / 4)]
    assert taken == list(range(0, 41, 4)) and session.counts["between steps"] == 30


def test_it_starts_with_whole_measurements_that_its_law_takes():
    session = Session()
    session.autopilot.refuses = True
    assert session.at(1.0) is None and "lead to a finite command" in session.state()
    assert session.at(1.01, position=(0.0, np.nan, 0.0)) is None
    assert session.state() == "no valid measurement: position not measured"
    session.autopilot.refuses = False
    assert session.at(1.02) == ("start", None)
    assert session.at(1.03, position=(0.0, np.nan, 0.0)) == ("step", None)


def test_silence_stops_it_and_the_next_measurement_starts_it_at_what_is_applied():
    session = Session()
    assert not session.is_safe_output_due(0.0)  # it has not run
    session.at(1.0)
    session.follow(None, 1.0 + MAX_AGE)
    assert session.running
    session.follow(None, 1.01 + MAX_AGE)
    assert not session.running and session.state() == "no valid measurement"
    due = [session.is_safe_output_due(1.51 + k * 1.01 * SAFE_PERIOD / 4) for k in range(9)]
    assert due == [True, False, False, False] * 2 + [True]
    assert session.at(2.0) == ("start", list(APPLIED)) and session.counts["starts"] == 2


def test_a_pose_is_what_counts_as_fresh():
    session = Session()
    session.at(1.0)
    calls = [session.at(1.0 + k * PERIOD, position=(np.nan, 0.0, 0.0)) for k in range(1, 60)]
    assert calls[:50] == [("step", None)] * 50 and calls[50:] == [None] * 9


@pytest.mark.parametrize("state", [("STOPPED", "chattering"), ("SAFE", "depth"), ("DEGRADED", "place_held")])
def test_what_a_supervisor_holds_is_the_operators_to_end(state):
    """Silence does not end it; an objection, such as disarming, does."""
    session = Session()
    session.at(1.0)
    session.autopilot.state = state
    assert session.at(3.0) == ("step", 2.0)
    assert session.at(3.01) == ("step", None)
    session.follow(None, 3.01, "disarmed")
    assert session.state("disarmed") == "disarmed" and not session.running
    assert session.at(3.02, "disarmed") is None
    assert session.at(3.03) == ("start", list(APPLIED))


def test_a_clock_that_was_set_starts_it_again():
    """Whatever the new time is: it is no time that has passed."""
    session = Session()
    session.at(100.0)
    assert session.at(7.0, elapsed=0.0) == ("start", list(APPLIED))
    assert session.at(7.01) == ("step", None)
    session.autopilot.state = ("STOPPED", "operator")
    assert session.at(9000.0, elapsed=0.0) == ("step", None)


def test_irregular_measurements_stop_it():
    session = Session()
    calls = [session.at(1.0 + 0.02 * k) for k in range(MOST + 3)]
    assert calls[:MOST][-1] is not None and calls[MOST:] == [None] * 3
    assert session.state() == "irregular measurements" and session.counts["irregular"] == 1


class Scripted(AbstractPacingLink):
    """Measures at the multiples of the period of a simulated clock; a wait may take long."""

    def __init__(self, clock, long_wait=None, silent=(np.inf, np.inf)):
        self.form, self.clock, self.long_wait, self.silent = FORM, clock, long_wait, silent
        self.sent, self.notes, self.discarded, self.turns, self.waiting = [], [], 0, 0, False

    def wait(self, longest):
        self.turns += 1
        passed = 2.0 if self.turns == self.long_wait else PERIOD
        self.clock.sleep_until(self.clock.now() + passed)
        self.waiting = True

    def discard(self):
        self.discarded, self.waiting = self.discarded + 1, False

    def receive(self, elapsed):
        waiting, self.waiting = self.waiting, False
        now = self.clock.now()
        if not waiting or self.silent[0] <= now <= self.silent[1]:
            return None
        return LinkMeasurement(np.zeros(3), np.zeros(6), np.array([1.0, 0, 0, 0]), stamp=round(now * 1e9))

    def send(self, command):
        self.sent.append((self.clock.now(), command.copy()))

    def finish(self, safe):
        self.sent.append((self.clock.now(), safe.copy()))

    def note_begin(self):
        self.notes.append("begin")

    def note_stop(self, reason):
        self.notes.append(reason)

    def counts(self):
        return {"scripted": self.turns}


def run(seconds, report=lambda line: None, **options):
    clock = SimulatedClock()
    link, autopilot = Scripted(clock, **options), Noting()
    loop = RealTimeLoop(autopilot, link, clock, LoopSettings(safe=SAFE, max_age=MAX_AGE), report=report)
    assert loop.run(periods=seconds / PERIOD) is Reason.COMPLETED
    return loop, link, autopilot


def test_a_silent_vehicle_gets_the_safe_output_until_it_measures_again():
    lines = []
    loop, link, autopilot = run(4.0, silent=(1.0, 2.5), report=lines.append)
    assert link.notes == ["begin", "no valid measurement", "begin"]
    safe = [time for time, command in link.sent if (command == SAFE).all()]
    assert safe[0] == pytest.approx(0.99 + MAX_AGE + PERIOD, abs=1.5 * PERIOD)
    np.testing.assert_allclose(np.diff(safe[:-1]), SAFE_PERIOD, atol=1.5 * PERIOD)
    assert safe[-2] < 2.52 and safe[-1] == pytest.approx(4.0, abs=2 * PERIOD)  # the last thing that is sent
    assert loop.statistics.steps == len(link.sent) - len(safe) == len(autopilot.calls)
    assert (
        re.match(r"running, ACTIVE; \d+ Hz; step p50 .*; scripted 100; starts 1$", lines[0])
        and "no valid measurement; " in lines[1]
    )


def test_what_came_while_the_loop_stood_still_is_forgotten():
    _, link, autopilot = run(4.0, long_wait=100)
    assert link.discarded == 1 and link.notes == ["begin", "no valid measurement", "begin"]
    assert autopilot.calls.count(("start", None)) == 1 and 2.0 > MAX_AGE + LOOK
