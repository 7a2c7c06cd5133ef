"""The messages that a companion asks its autopilot for."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from undertow.outside.mavlink.actuator_commands import MavlinkTarget
from undertow.outside.mavlink.message_requests import MessageRequests

pytestmark = pytest.mark.interop

ATTITUDE, POSITION = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
ACCEPTED, DENIED, LATER = (
    mavlink.MAV_RESULT_ACCEPTED,
    mavlink.MAV_RESULT_DENIED,
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
)


@pytest.fixture
def requests():
    return MessageRequests("local_position", MavlinkTarget(7, 1), 0.02)


def asked(requests, now):
    """Number of the message that is asked for at a time; None without one."""
    found = [(one.target_system, one.target_component, one.command, one.param2) for one in requests.due(now)]
    assert all(one == (7, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 20_000.0) for one in found) and len(found) <= 1
    return requests_of(requests) if found else None


def requests_of(requests):
    return getattr(mavlink, f"MAVLINK_MSG_ID_{requests._asked}")


def answer(requests, now, result):
    requests.note(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, result), now)


def position(requests, now):
    requests.note(mavlink.MAVLink_local_position_ned_message(round(1e3 * now), 0, 0, 0, 0, 0, 0), now)


def attitude(requests, now):
    requests.note(mavlink.MAVLink_attitude_quaternion_message(round(1e3 * now), 1, 0, 0, 0, 0, 0, 0), now)


def test_both_are_asked_for_in_turn_until_they_are_granted(requests):
    assert asked(requests, 0.0) == ATTITUDE and asked(requests, 0.5) is None
    assert asked(requests, 1.0) == POSITION and asked(requests, 2.0) == ATTITUDE
    answer(requests, 2.1, LATER)
    assert asked(requests, 3.0) == POSITION
    answer(requests, 3.1, ACCEPTED)
    assert asked(requests, 4.0) == ATTITUDE
    answer(requests, 4.1, ACCEPTED)
    assert asked(requests, 5.0) is None and requests.complaint() == ""


def test_what_comes_often_enough_needs_no_answer(requests):
    """50 Hz is asked for: 4 Hz of some stream are not enough, 40 Hz are."""
    assert asked(requests, 0.0) == ATTITUDE
    for k in range(40):
        attitude(requests, 0.025 * k)
    assert asked(requests, 1.0) == POSITION
    for k in range(4):
        position(requests, 1.0 + 0.25 * k)
    assert asked(requests, 2.0) == POSITION
    for k in range(40):
        position(requests, 2.0 + 0.025 * k)
    assert asked(requests, 3.0) is None


def test_what_is_refused_is_said_until_it_comes(requests):
    asked(requests, 0.0)
    answer(requests, 0.1, DENIED)
    assert requests.complaint() == "the vehicle refuses to send ATTITUDE_QUATERNION (MAV_RESULT_DENIED)"
    assert [asked(requests, float(k)) for k in (1, 2, 3)] == [POSITION] * 3
    answer(requests, 3.1, ACCEPTED)
    for k in range(40):
        position(requests, 4.0 + 0.15 * k)
    assert asked(requests, 10.0) is None and asked(requests, 10.2) == ATTITUDE  # once more, ten seconds later
    assert "refuses" in requests.complaint()
    attitude(requests, 10.5)
    assert requests.complaint() == ""


def test_an_autopilot_that_was_restarted_is_asked_again(requests):
    """What was granted is silent for more than three seconds; and after it was not there at all."""
    for k in (0, 1):
        asked(requests, float(k))
        answer(requests, k + 0.1, ACCEPTED)
    for k in range(20):
        position(requests, 2.0 + 0.1 * k)
        attitude(requests, 2.0 + 0.1 * k)
        assert asked(requests, 2.0 + 0.1 * k) is None
    position(requests, 6.0)
    assert asked(requests, 7.0) == ATTITUDE
    requests.begin_again()
    assert {asked(requests, 8.5), asked(requests, 9.5)} == {ATTITUDE, POSITION}


def test_answers_to_other_commands_are_none(requests):
    asked(requests, 0.0)
    requests.note(mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_DO_SET_SERVO, DENIED), 0.1)
    assert requests.complaint() == "" and asked(requests, 1.0) == POSITION
