"""When the law of a companion runs, and what the thrusters get when it does not; messages only, without a socket."""

import copy
import json

import numpy as np
import pytest
from driven_scenario import DRIVEN
from pymavlink.dialects.v20 import common as mavlink

import undertow as ut
from undertow.core.errors import BadInput
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.mavlink import Companion
from undertow.outside.mavlink.companion import HEARTBEAT_PERIOD
from undertow.outside.mavlink.message_codec import parsed
from undertow.outside.mavlink.message_requests import MessageRequests
from undertow.outside.mavlink.permission import HEARTBEAT_TIMEOUT, Permission
from undertow.outside.realtime.control_session import SAFE_PERIOD, ControlSession
from undertow.outside.realtime.measurement_rate import MOST, WINDOW
from undertow.outside.realtime.sender_clock import SenderClock
from undertow.studies.identification.experiment_scenario import LAW

pytestmark = pytest.mark.interop

TIMEOUT = 0.5
FORM = Format("quaternion", "body")
STILL = [1500] * 8


class Talk:
    """A companion with its controller, and what its vehicle says through the wire."""

    def __init__(self, companion, from_safe=False):
        self.companion, self.wire = companion, mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        still = np.zeros(len(companion.channels.numbers))
        self.session = ControlSession(companion.autopilot, FORM, companion.timeout, still, from_safe)
        self.now, self.time_usec = 100.0, 0

    def say(self, message, wire=None):
        (received,) = parsed(message.pack(wire or self.wire))
        return self.hear(received)

    def hear(self, received):
        measurement, was_running = self.companion.receive(received, self.now), self.session.running
        volts = self.session.follow(measurement, self.now, self.companion.objection(self.now))
        if volts is None:
            return []
        if not was_running:
            self.companion.note_begin()
        return self.companion.commands(volts, 1000 * self.time_usec)

    @property
    def state(self):
        return self.session.state(self.companion.objection(self.now))

    @property
    def starts(self):
        return self.session.counts["starts"]

    @property
    def steps_counted(self):
        return self.companion.autopilot.counts

    def heartbeat(
        self,
        armed=True,
        autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
        wire=None,
        mode=0,
        status=mavlink.MAV_STATE_ACTIVE,
    ):
        flags, kind = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0, mavlink.MAV_TYPE_SUBMARINE
        return self.say(mavlink.MAVLink_heartbeat_message(kind, autopilot, flags, mode, status, 3), wire)

    def odometry(self, place=(0, 0, 0), q=(1, 0, 0, 0), velocity=(0,) * 6, after=10_000, resets=0, wire=None, frame=1):
        self.time_usec += after
        self.now += 0.01
        none = 21 * [0.0]
        motion = [*place, list(q), *velocity]
        made = mavlink.MAVLink_odometry_message
        return self.say(made(self.time_usec, frame, 12, *motion, none, none, resets, 3, 0), wire)

    def idle(self, passed=0.0):
        self.now += passed
        self.time_usec += round(1e6 * passed)
        self.session.follow(None, self.now, self.companion.objection(self.now))
        due = self.session.is_safe_output_due(self.now)
        return self.companion.due(self.now) + (self.companion.commands(np.zeros(8)) if due else [])


def pulses(messages):
    """Pulses of channels 1 to 8 of the one command."""
    (found,) = messages
    assert found.get_type() == "RC_CHANNELS_OVERRIDE"
    return [getattr(found, f"chan{n}_raw") for n in range(1, 9)]


def neutrals(messages):
    return [one for one in messages if one.get_type() == "RC_CHANNELS_OVERRIDE"]


def copied(state):
    """Attributes of a companion, with copies of those that change inside."""
    changing = dict | SenderClock | Permission | MessageRequests
    return {name: copy.deepcopy(value) if isinstance(value, changing) else value for name, value in state.items()}


@pytest.fixture(scope="module")
def made(driven):
    """Compiled once; `talk` begins with the state that a new one has."""
    companion = Companion(driven, timeout=TIMEOUT)
    return companion, copied(vars(companion))


@pytest.fixture
def talk(made):
    companion, fresh = made
    vars(companion).update(copied(fresh))
    return Talk(companion)


def test_commands_are_those_of_the_autopilot_by_itself(talk):
    """The pulses of `ut.Autopilot` with the same measurements, mirrored on the reversed channels."""
    by_itself = ut.Autopilot(DRIVEN, attitude="quaternion", output="input")
    talk.heartbeat()
    places = np.linspace([0, 0, 0], [0.125, -0.25, 0.5], 5)  # exact in single precision
    first = by_itself.start(places[0], np.zeros(6), [1, 0, 0, 0])
    applied = np.round(400 * first / 16) * 16 / 400
    applied[np.abs(applied) <= 1.0] = 0.0  # the dead band of 25 us
    assert pulses(talk.odometry(places[0])) == (1500 - np.round(400 * np.clip(first, -16, 16) / 16)).tolist()
    for place in places[1:]:
        volts = by_itself.step(place, np.zeros(6), [1, 0, 0, 0], applied=applied, dt=0.01)
        steps = np.round(400 * np.clip(volts, -16, 16) / 16)
        assert pulses(talk.odometry(place)) == (1500 - steps).tolist()
        applied = np.where(np.abs(steps) > 25, steps, 0) / 400 * 16


def test_nothing_is_sent_before_the_vehicle_is_armed(talk):
    """And nothing that would arm it, ever."""
    sent = talk.odometry() + talk.heartbeat(armed=False) + talk.odometry() + talk.idle()
    assert [one.get_type() for one in sent] == ["HEARTBEAT", "COMMAND_LONG"]
    assert sent[1].command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    assert talk.state == "disarmed"
    talk.heartbeat(armed=True)
    assert talk.state == "no valid measurement"
    assert len(pulses(talk.odometry())) == 8 and talk.state == "running, ACTIVE"


def test_our_heartbeat(talk):
    (first,) = talk.idle()
    assert (first.type, first.autopilot, first.base_mode) == (
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_AUTOPILOT_INVALID,
        0,
    )
    assert talk.idle(0.5 * HEARTBEAT_PERIOD) == []
    assert [one.get_type() for one in talk.idle(0.5 * HEARTBEAT_PERIOD)] == ["HEARTBEAT"]


def test_disarming_stops_the_law(talk):
    talk.heartbeat()
    talk.odometry()
    talk.heartbeat(armed=False)
    assert [pulses([one]) for one in neutrals(talk.idle())] == [STILL]
    assert neutrals(talk.idle(0.5 * SAFE_PERIOD)) == [] and len(neutrals(talk.idle(SAFE_PERIOD))) == 1
    assert talk.odometry() == []
    talk.heartbeat()
    assert pulses(talk.odometry()) and talk.starts == 2


def test_lost_odometry_stops_the_law(talk):
    talk.heartbeat()
    talk.odometry()
    assert neutrals(talk.idle(0.9 * TIMEOUT)) == []
    assert len(neutrals(talk.idle(0.2 * TIMEOUT))) == 1
    assert talk.state == "no valid measurement"
    assert pulses(talk.odometry()) and talk.starts == 2


def test_a_lost_heartbeat_stops_the_law(talk):
    """Although odometry goes on."""
    talk.heartbeat()
    began = talk.now
    while talk.now + 0.02 < began + HEARTBEAT_TIMEOUT:
        assert pulses(talk.odometry())
    talk.now += 0.03
    assert talk.odometry() == [] and len(neutrals(talk.idle())) == 1
    assert talk.state == "no heartbeat of system 1"


def test_others_are_ignored(talk):
    """Another system, whatever it says; a camera of the same system that says it is disarmed."""
    other = mavlink.MAVLink(None, srcSystem=2, srcComponent=1)
    talk.heartbeat(wire=other)
    assert talk.odometry() == [] and not talk.companion.armed
    talk.heartbeat()
    assert talk.odometry(wire=other) == []
    assert talk.companion.counts["foreign"] == 2
    talk.heartbeat(armed=False, autopilot=mavlink.MAV_AUTOPILOT_INVALID)
    assert talk.companion.armed and pulses(talk.odometry())


def test_odometry_in_other_axes_is_ignored(talk):
    talk.heartbeat()
    talk.odometry()
    assert talk.odometry(frame=mavlink.MAV_FRAME_LOCAL_ENU) == []
    assert talk.companion.counts["invalid"] == 1 and "MAV_FRAME_LOCAL_ENU" in talk.companion.complaint
    assert len(neutrals(talk.idle(1.1 * TIMEOUT))) == 1


def test_nan_is_what_was_not_measured(talk):
    """The law begins with a whole odometry, goes on without a velocity, and stops without a pose."""
    talk.heartbeat()
    assert talk.odometry(velocity=[np.nan] * 6) == [] and talk.starts == 0
    talk.odometry()
    for hole in ({"velocity": [np.nan] * 6}, {"place": [np.nan, 0, 0]}, {"q": [0, 0, 0, 0]}):
        assert all(1100 <= one <= 1900 for one in pulses(talk.odometry(**hole)))
    for _ in range(round(TIMEOUT / 0.01) + 2):
        talk.odometry(place=[np.nan] * 3)
    assert not talk.session.running


def test_the_same_odometry_again(talk):
    talk.heartbeat()
    talk.odometry()
    assert talk.odometry(after=0) == [] and talk.companion.counts["repeated"] == 1


@pytest.mark.parametrize("jump", [-3600 * 10**6, 86400 * 10**6])
def test_a_clock_that_is_set(talk, jump):
    """Back by an hour, on by a day: for half a second its odometry may be old, and then the law begins again."""
    talk.time_usec = 10**15
    talk.heartbeat()
    talk.odometry()
    talk.time_usec += jump
    used = [bool(talk.odometry()) for _ in range(60)]
    assert used.index(True) == 50 and all(used[50:])
    assert talk.companion.counts["clock jumps"] == 1 and talk.companion.counts["old"] == 50
    assert talk.starts == 2


def test_irregular_odometry_stops_the_law(talk):
    """Half of it is lost: the fifth late one within a second is not answered, until a second has passed without."""
    talk.heartbeat()
    talk.odometry()
    answered = [bool(talk.odometry(after=20_000)) for _ in range(MOST + 3)]
    assert answered == [True] * (MOST - 1) + [False] * 4
    assert talk.session.counts["irregular"] == 1 and talk.state == "irregular measurements"
    assert [pulses([one]) for one in neutrals(talk.idle())] == [STILL]
    regular = [bool(talk.odometry()) for _ in range(102)]
    assert regular.index(True) in (99, 100) and all(regular[-2:]) and WINDOW == 1.0
    assert talk.starts == 2 and talk.session.running


def test_a_few_late_steps_go_on(talk):
    """Four in a second, second after second."""
    talk.heartbeat()
    talk.odometry()
    for k in range(1, 300):
        if k % 100 == 0:
            talk.heartbeat()
        assert pulses(talk.odometry(after=20_000 if k % 26 == 0 else 10_000))
    assert talk.session.counts["irregular"] == 0 and talk.steps_counted["late"] > MOST


def test_a_target_relative_to_where_control_begins(driven, talk):
    """North and east count from there, and depth does not; also where the law begins again, or the estimator jumps."""
    relative = Companion(driven, timeout=TIMEOUT, relative=True)
    moved, still = Talk(relative), talk
    for one in (moved, still):
        one.heartbeat()
    place = np.array([13.0, -8.0, 0.0])
    way = np.linspace([0, 0, 0.25], [0.125, -0.25, 0.5], 5)
    for at in way:
        assert pulses(moved.odometry(at + place)) == pulses(still.odometry(at))
    for one in (moved, still):  # nothing comes for a while: the law begins again, and the target stays
        one.idle(2 * TIMEOUT)
    assert pulses(moved.odometry(way[4] + place)) == pulses(still.odometry(way[4]))
    jumped = place + [4.0, 4.0, 0.0]
    assert pulses(moved.odometry(way[4] + jumped, resets=1)) == pulses(still.odometry(way[4], resets=1))
    for one in (moved, still):  # armed again: it counts from the new place
        one.heartbeat(armed=False)
        one.heartbeat()
    assert pulses(moved.odometry(way[4] + jumped, resets=1)) == pulses(still.odometry([0, 0, 0.5], resets=1))


def test_steps_that_are_late(talk):
    talk.heartbeat()
    talk.odometry()
    assert pulses(talk.odometry(after=20_000))
    assert talk.steps_counted["late"] == 1


def test_old_odometry_is_not_the_present(talk):
    """Two of a while ago come in turn, as from a replay: the law stops as where none comes."""
    talk.heartbeat()
    for _ in range(20):
        talk.odometry()
    newest = talk.time_usec
    for k in range(300):
        talk.time_usec = newest - 150_000 - 50_000 * (k % 2)
        assert talk.odometry(after=0) == []
        talk.idle()
    assert not talk.session.running and talk.starts == 1
    assert talk.companion.counts["clock jumps"] == 0


def test_a_queue_that_grew_old(talk):
    """One second late, and the present again: only that is used."""
    talk.heartbeat()
    talk.odometry()
    present = talk.time_usec + 10_000
    talk.now += 1.0
    assert talk.odometry() == [] and talk.companion.counts["old"] == 1
    talk.time_usec = present + 1_000_000
    assert pulses(talk.odometry()) and talk.starts == 2


def test_another_component_is_not_the_autopilot(talk):
    """A camera with an odometry of its own, 50 m away; a gimbal that says that it is armed."""
    other = mavlink.MAVLink(None, srcSystem=1, srcComponent=197)
    talk.heartbeat(wire=other)
    assert talk.odometry() == []
    talk.heartbeat()
    assert pulses(talk.odometry())
    assert talk.odometry(place=[50, 0, 0], wire=other) == []
    assert talk.companion.counts["foreign"] == 2 and pulses(talk.odometry())


@pytest.mark.parametrize("change", [{"mode": 19}, {"status": mavlink.MAV_STATE_CRITICAL}, {"status": 6}])
def test_the_pilot_and_the_failsafes_of_the_autopilot_come_first(talk, change):
    """Another flight mode, a failsafe, an emergency: neutral, until it is as it was."""
    talk.heartbeat()
    talk.odometry()
    talk.heartbeat(**change)
    assert not talk.session.running and [pulses([one]) for one in neutrals(talk.idle())] == [STILL]
    assert talk.odometry() == [] and talk.state != "running"
    talk.heartbeat()
    assert pulses(talk.odometry()) and talk.starts == 2


def test_a_position_that_leaps_stops_the_law_until_the_pilot_agrees(talk):
    """Its target is where it was, so that the thrusters would give all they can."""
    talk.heartbeat()
    talk.odometry()
    assert talk.odometry(place=[20, 0, 0]) == [] and talk.companion.counts["leaps"] == 1
    assert [pulses([one]) for one in neutrals(talk.idle())] == [STILL]
    assert talk.odometry(place=[20, 0, 0]) == [] and "leapt" in talk.state
    talk.heartbeat(armed=False)
    talk.heartbeat()
    assert pulses(talk.odometry(place=[20, 0, 0]))


def test_an_estimator_that_jumps(talk):
    """The reference begins at the new place: no command for the distance of the jump, only for the same start."""
    talk.heartbeat()
    at_start = np.array(pulses(talk.odometry())) - 1500
    again = np.array(pulses(talk.odometry(place=[50, 50, 0], resets=1))) - 1500
    assert (np.abs(again) <= np.abs(at_start)).all() and (again * at_start >= 0).all() and again.any()
    assert talk.companion.counts["estimator resets"] == 1 and talk.starts == 2


def test_a_command_that_is_rejected(talk):
    talk.say(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_SET_SERVO, mavlink.MAV_RESULT_DENIED))
    talk.say(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_SET_SERVO, mavlink.MAV_RESULT_ACCEPTED))
    talk.say(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_RESULT_DENIED))
    assert talk.companion.counts["rejected commands"] == 1
    assert talk.companion.complaint == "command 183 was answered MAV_RESULT_DENIED"


def test_a_start_without_a_jump(driven):
    """Without a supervisor the output turns from neutral into the law's within seconds."""
    talk = Talk(Companion(driven, output="servo", unsupervised=True), from_safe=True)
    talk.heartbeat()
    first = talk.odometry(place=[0.5, 0.5, 0.5])
    assert [(one.param1, one.param2) for one in first] == [(n, 1500) for n in range(1, 9)]
    last = [one.param2 for one in talk.odometry(place=[0.5, 0.5, 0.5])]
    assert max(abs(np.array(last) - 1500)) < 40


def test_a_supervised_start_without_a_jump(driven):
    """With it, as links have it, from neutral and no faster than a range per second."""
    companion = Companion(driven, output="servo")
    talk = Talk(companion, from_safe=True)
    talk.heartbeat()
    first = np.array([one.param2 for one in talk.odometry(place=[0.5, 0.5, 0.5])])
    assert 0 < np.abs(first - 1500).max() <= 800 * companion.autopilot.sampling_time + 1
    assert talk.state == "running, ACTIVE"


def test_anything_may_arrive(talk):
    """Mutated messages of a vehicle, and random bytes: nothing raises, and commands stay pulses of servos."""
    chance = np.random.default_rng(20261124)
    messages = [
        mavlink.MAVLink_heartbeat_message(12, 3, 128, 0, 4, 3),
        mavlink.MAVLink_odometry_message(
            1, 1, 12, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0, 0, 0, 0, 21 * [0.0], 21 * [0.0], 0, 3, 0
        ),
        mavlink.MAVLink_local_position_ned_message(1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_attitude_quaternion_message(1, 1, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_command_ack_message(183, 0),
        mavlink.MAVLink_param_value_message(b"NAME", 1.0, 9, 1, 0),
    ]
    sent = accepted = 0
    for k in range(9000):
        talk.now += 0.001 / len(messages)  # so often that odometry is regular although most is lost
        message = messages[k % len(messages)]
        if message.get_type() == "ODOMETRY":
            message.time_usec += int(chance.integers(-300, 2300)) if message.time_usec > 5_000 else 5_000
            message.x, message.vx = (float(one) for one in chance.choice([0.0, 0.9, -0.1, np.nan, np.inf, 1e30], 2))
        data = bytearray(message.pack(talk.wire))
        if chance.integers(2):
            for _ in range(chance.integers(1, 4)):
                data[chance.integers(len(data))] ^= int(chance.integers(1, 256))
        if not chance.integers(5):
            data = data[: chance.integers(len(data))] + chance.bytes(int(chance.integers(30)))
        for one in parsed(bytes(data)):
            accepted += 1
            for answer in talk.hear(one):
                sent += 1
                assert all(1100 <= pulse <= 1900 for pulse in pulses([answer]))
    assert sent > 50 and accepted > 3000
    assert parsed(chance.bytes(5000)) == []


@pytest.mark.parametrize(
    "options, said",
    [
        ({"target_system": 0}, "`target_system` must be from 1 to 255"),
        ({"timeout": 0.0}, "`timeout` must be positive"),
        ({"source": "gps"}, "`input` must be one of odometry, local_position"),
    ],
)
def test_wrong_options(driven, options, said):
    with pytest.raises(BadInput, match=said):
        Companion(driven, **options)


def test_an_experiment_pushes_and_a_limit_ends_it(tmp_path):
    """The vehicle rests at its target, so that the pulses are those of the script alone: 40 N forward from 50 ms on."""
    script = "t,d1,d2,d3,d4,d5,d6\n0,0,0,0,0,0,0\n0.05,40,0,0,0,0,0\n9,0,0,0,0,0,0\n"
    scenario = DRIVEN | {
        "controller": {"kind": "experiment", "csv": script, "law": LAW, "room": [1, 1, 1]},
        "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
        "disturbance": "none",
        "initial": {},
    }
    path = tmp_path / "experiment.yaml"
    path.write_text(json.dumps(scenario))
    talk = Talk(Companion(path, timeout=TIMEOUT))
    talk.heartbeat()
    before = [pulses(talk.odometry()) for _ in range(4)]
    pushed = [pulses(talk.odometry()) for _ in range(8)][-1]
    talk.odometry(place=(0.7, 0, 0))
    after = [pulses(talk.odometry()) for _ in range(8)][-1]
    assert before == [STILL] * 4
    assert np.abs(np.array(after) - 1500).max() <= 3  # what the law has integrated outside the room
    horizontal, vertical = (np.array(pushed) - 1500).reshape(2, 4)  # the latter hold the pitch
    assert (np.abs(horizontal) > 100).all() and (horizontal[:2] * horizontal[2:] < 0).all()
    assert vertical[0] == vertical[1] and vertical[2] == vertical[3]
