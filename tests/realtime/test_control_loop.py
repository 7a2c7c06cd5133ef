"""The loop by itself, with a clock that stalls: overruns, periods, what the controller is told, the safe output."""

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.outside.realtime.control_loop import LoopSettings, RealTimeLoop, Reason
from undertow.outside.realtime.link import AbstractLink, LinkMeasurement
from undertow.outside.realtime.loop_clock import SimulatedClock

PERIOD = 0.01
SAFE = np.array([0.25, -0.5])


class TwoInputs:
    outputs = ("position",)

    def inputs(self):
        return 2


class Counting:
    """Commands the number of the step, and notes what it was told; a step may take a while."""

    sampling_time = PERIOD
    plant = TwoInputs()

    def __init__(self, clock=None, durations=()):
        self.clock, self.durations = clock, list(durations)
        self.told, self.given, self.starts = [], [], 0

    def start(self, *motion, **more):
        self.starts += 1
        return self.step(*motion, dt=0.0, **more)

    def step(self, *motion, dt, **more):
        if self.clock is not None and len(self.told) < len(self.durations):
            self.clock.advance(self.durations[len(self.told)])
        self.told.append(dt)
        self.given.append(motion[0])
        return np.full(2, float(len(self.told)))

    def log_step(self):
        pass


class Stalling(SimulatedClock):
    """A clock that wakes late by given times; each is used once."""

    def __init__(self, late=()):
        super().__init__()
        self.late = list(late)

    def advance(self, time):
        self._now += time

    def sleep_until(self, instant):
        super().sleep_until(instant)
        if self.late:
            self.advance(self.late.pop(0))


class Noting(AbstractLink):
    """Measures always, or as asked, and notes commands with their times."""

    form = None

    def __init__(self, clock, measures=lambda k: True):
        self.clock, self.measures, self.asked = clock, measures, 0
        self.sent, self.waiting, self.closed = [], 0, False

    def receive(self, elapsed):
        self.asked += 1
        found = self.measures(self.asked - 1)
        return LinkMeasurement(np.zeros(1), np.zeros(1)) if found else None

    def send(self, command):
        assert not self.closed
        self.sent.append((self.clock.now(), command.copy()))

    def finish(self, safe):
        self.send(safe)
        self.closed = True

    def await_measurement(self, safe):
        self.waiting += 1

    def counts(self):
        return {}


def made(late=(), durations=(), measures=lambda k: True, stop=lambda: False, **settings):
    clock = Stalling(late)
    autopilot, link = Counting(clock, durations), Noting(clock, measures)
    loop = RealTimeLoop(autopilot, link, clock, LoopSettings(safe=SAFE, **settings), stop)
    return loop, autopilot, link


def test_an_even_clock_gives_one_command_per_period_and_no_jitter():
    loop, autopilot, link = made()
    assert loop.run(100) is Reason.COMPLETED
    np.testing.assert_allclose([at for at, _ in link.sent[:-1]], PERIOD * np.arange(100), rtol=0, atol=1e-12)
    assert autopilot.told == [0.0] + [PERIOD] * 99  # to the bit
    found = loop.statistics
    assert (found.steps, found.overruns, found.missed, found.stale) == (100, 0, 0, 0)
    assert found.jitter.summary()["max"] < 1e-12 and found.lateness.summary()["max"] == 0.0


@pytest.mark.parametrize("where", ["late", "durations"])
def test_every_one_of_1000_stalls_is_counted_within_two_periods(where):
    """Stalls of 1.01 to 30 periods, before or within a step: each is one overrun, and its periods are missed."""
    chance = np.random.default_rng(5)
    stalls = np.zeros(5000)
    at = 1 + np.sort(chance.choice(2400, 1000, replace=False)) * 2
    stalls[at] = PERIOD * chance.uniform(1.01, 30, 1000)
    clock = Stalling()
    autopilot = Counting(clock, stalls) if where == "durations" else Counting()
    clock.late = list(stalls[1:]) if where == "late" else []
    link = Noting(clock)
    seen = []
    step = autopilot.step

    def noted(*motion, **more):
        seen.append((clock.now(), loop.statistics.overruns))
        return step(*motion, **more)

    autopilot.step = noted
    loop = RealTimeLoop(autopilot, link, clock, LoopSettings(safe=SAFE))
    loop.run(5000)
    assert loop.statistics.overruns == 1000
    # A stall that begins in step k is known in step k + 1, which begins within one period after it.
    counted = np.array([number for _, number in seen])
    assert (np.diff(counted)[at[at < 4999]] == 1).all()
    begun = np.array([time for time, _ in seen])
    ended = begun + (stalls if where == "durations" else 0)
    assert (begun[1:] - ended[:-1])[stalls[1:] == 0].max() <= PERIOD * (1 + 1e-9)
    # Every period has a command or is missed, and the controller is told all of the time.
    last = loop.statistics.steps + loop.statistics.missed
    assert last * PERIOD == pytest.approx(np.ceil(link.sent[-2][0] / PERIOD + 1e-9) * PERIOD, abs=2 * PERIOD)
    assert sum(autopilot.told) == pytest.approx(begun[-1], abs=PERIOD)


def test_no_period_has_two_commands():
    chance = np.random.default_rng(6)
    late, durations = PERIOD * chance.exponential(0.5, 3000), PERIOD * chance.exponential(0.5, 3000)
    loop, _, link = made(late, durations)
    loop.run(3000)
    periods = np.floor(np.array([at for at, _ in link.sent[:-1]]) / PERIOD)
    assert (np.diff(periods) >= 1).all()
    assert loop.statistics.missed > 100


def test_a_late_command_is_told_as_two_periods():
    loop, autopilot, link = made(durations=[0, 1.2 * PERIOD])
    loop.run(4)
    np.testing.assert_allclose([at / PERIOD for at, _ in link.sent[:-1]], [0, 2.2, 3, 4])
    assert autopilot.told == [0.0, PERIOD, 2 * PERIOD, PERIOD]
    assert (loop.statistics.overruns, loop.statistics.missed) == (1, 1)


def test_lateness_beyond_a_tenth_of_a_period_is_told_as_it_is():
    loop, autopilot, _ = made(late=[0.05 * PERIOD, 0.6 * PERIOD, 0.0])
    loop.run(4)
    np.testing.assert_allclose(np.array(autopilot.told) / PERIOD, [0, 1, 1.6, 0.4])


def test_a_step_soon_after_a_late_one_is_a_step():
    """Late by 0.95 periods and then on time: the controller gets 1.95 and 0.05 periods, not zero."""
    loop, autopilot, _ = made(late=[0.95 * PERIOD, 0.0])
    loop.run(4)
    np.testing.assert_allclose(np.array(autopilot.told) / PERIOD, [0, 1.95, 0.05, 1], atol=1e-9)


def test_jitter_against_known_numbers():
    """Beginnings are late by 0.4 ms in every second step: the period departs by 0.4 ms each time."""
    loop, _, _ = made(late=[0.0004, 0.0] * 500, durations=[0.002] * 1001)
    loop.run(1001)
    jitter, computing = loop.statistics.jitter.summary(), loop.statistics.computing.summary()
    assert jitter["number"] == 1000
    for name in ("mean", "rms", "p50", "p99", "p99.9", "max"):
        assert jitter[name] == pytest.approx(0.0004, rel=0.006), name
        assert computing[name] == pytest.approx(0.002, rel=0.006), name
    assert loop.statistics.lateness.summary()["mean"] == pytest.approx(500 * 0.0004 / 1001)


def test_a_deadline_within_the_period_is_kept_or_counted():
    loop, _, _ = made(durations=[0.0, 0.4 * PERIOD, 0.6 * PERIOD, 0.0], deadline=0.5 * PERIOD)
    loop.run(4)
    assert (loop.statistics.overruns, loop.statistics.missed) == (1, 0)


def test_a_step_without_measurement_gives_the_controller_none():
    loop, autopilot, _ = made(measures=lambda k: k != 2)
    loop.run(5)
    assert [bool(np.isnan(given).any()) for given in autopilot.given] == [False, False, True, False, False]
    assert loop.statistics.stale == 1 and loop.statistics.longest_stale == pytest.approx(PERIOD)


def test_a_silent_link_ends_with_the_safe_output_after_the_stated_time():
    loop, _, link = made(measures=lambda k: k < 10, max_age=0.1)
    assert loop.run() is Reason.LINK_LOST
    assert loop.statistics.steps == 20  # ten with, ten without a measurement
    np.testing.assert_array_equal(link.sent[-1][1], SAFE)
    assert link.closed


def test_without_a_first_measurement_nothing_but_the_safe_output_is_sent():
    loop, autopilot, link = made(measures=lambda k: False, patience=1.0)
    assert loop.run() is Reason.NO_START
    assert link.waiting == pytest.approx(1.0 / PERIOD, abs=1) and not autopilot.told
    assert [command.tolist() for _, command in link.sent] == [SAFE.tolist()]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ValueError, MemoryError])
def test_whatever_is_raised_the_last_output_is_the_safe_one(error):
    loop, autopilot, link = made()

    def failing(*motion, **more):
        if len(link.sent) == 7:
            raise error
        return np.ones(2)

    autopilot.step = failing
    with pytest.raises(error):
        loop.run()
    np.testing.assert_array_equal(link.sent[-1][1], SAFE)
    assert len(link.sent) == 8 and link.closed


def test_it_stops_when_it_is_asked():
    asked = iter([False] * 6 + [True] * 9)
    loop, _, link = made(stop=lambda: next(asked))
    assert loop.run() is Reason.STOPPED
    np.testing.assert_array_equal(link.sent[-1][1], SAFE)


@pytest.mark.parametrize(
    "settings, said",
    [
        ({"deadline": 0.0}, "deadline"),
        ({"max_age": -1.0}, "max_age"),
        ({"patience": np.nan}, "patience"),
        ({"safe": [0.0, np.inf]}, "safe"),
        ({"safe": [0.0, 1.0, 2.0]}, "safe"),
    ],
)
def test_settings_that_cannot_be_used(settings, said):
    clock = Stalling()
    with pytest.raises(BadInput, match=said):
        RealTimeLoop(Counting(), Noting(clock), clock, LoopSettings(**settings))


def test_a_controller_that_stood_still_ends_as_a_silent_vehicle_does():
    """For 0.5 s at most; it does not go on from what was true before. In a loop of long periods two of them pass."""
    loop, _, link = made(late=[0.0, 0.48, 0.0, 0.52])
    assert loop.run(100) is Reason.STALLED
    assert loop.statistics.steps == 4
    np.testing.assert_array_equal(link.sent[-1][1], SAFE)
