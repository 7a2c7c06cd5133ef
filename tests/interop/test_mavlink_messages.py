"""Odometry from MAVLink messages, and commands for thrusters: values, and what is refused."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import quaternion_from_euler, rotation_from_quaternion
from undertow.outside.mavlink.actuator_commands import MavlinkTarget, Pulses, commands_of
from undertow.outside.mavlink.message_codec import parsed
from undertow.outside.mavlink.odometry import OdometryReader, in_body_axes, of_local_position, of_odometry

pytestmark = pytest.mark.interop

NED, FRD, ENU, BODY = (
    mavlink.MAV_FRAME_LOCAL_NED,
    mavlink.MAV_FRAME_LOCAL_FRD,
    mavlink.MAV_FRAME_LOCAL_ENU,
    mavlink.MAV_FRAME_BODY_FRD,
)
TURNED = np.asarray(quaternion_from_euler(np.array([0.3, -0.4, 1.2])))


def odometry(frames=(NED, BODY), q=TURNED, place=(1.0, -2.0, 3.0), velocity=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6), quality=0):
    none = 21 * [0.0]
    made = mavlink.MAVLink_odometry_message
    return made(
        1_500_000, *frames, *place, list(q), *velocity, none, none, 3, mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT, quality
    )


def through_the_wire(message):
    """The same after packing and parsing: single precision."""
    (found,) = parsed(message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1)))
    return found


@pytest.mark.parametrize("world", [NED, FRD])
def test_odometry(world):
    found = of_odometry(through_the_wire(odometry((world, BODY))))
    assert found.time_usec == 1_500_000 and found.resets == 3 and found.is_whole
    np.testing.assert_array_equal(found.position, [1, -2, 3])
    np.testing.assert_allclose(found.attitude, TURNED, rtol=0, atol=1e-7)
    assert np.linalg.norm(found.attitude) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(found.velocity, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], rtol=1e-7)


@pytest.mark.parametrize(
    "message, said",
    [
        (
            odometry((ENU, BODY)),
            "`ODOMETRY.frame_id` must be MAV_FRAME_LOCAL_NED or MAV_FRAME_LOCAL_FRD, but is MAV_FRAME_LOCAL_ENU",
        ),
        (odometry((200, BODY)), "`ODOMETRY.frame_id` must be .*, but is 200, which is no frame"),
        (odometry((NED, NED)), "`ODOMETRY.child_frame_id` must be MAV_FRAME_BODY_FRD, but is MAV_FRAME_LOCAL_NED"),
        (odometry(quality=-1), "`ODOMETRY.quality` must not be -1"),
        (odometry(velocity=[3e38, 0, 0, 0, 0, 0]), "`ODOMETRY velocity` must be at most 20 m/s, but is 3e.38 m/s"),
        (odometry(velocity=[0, 0, 0, 0, -21, 0]), "`ODOMETRY angular velocity` must be at most 20 rad/s"),
    ],
)
def test_odometry_that_is_not_used(message, said):
    with pytest.raises(BadInput, match=said):
        of_odometry(through_the_wire(message))


@pytest.mark.parametrize("q", [[0, 0, 0, 0], [2, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 0]])
def test_four_numbers_that_are_no_attitude(q):
    found = of_odometry(odometry(q=q))
    assert np.isnan(found.attitude).all() and not found.has_pose and not found.is_whole


def test_a_velocity_may_be_missing():
    found = of_odometry(odometry(velocity=[np.nan] * 6))
    assert found.has_pose and not found.is_whole


def test_position_and_attitude_make_odometry():
    """Velocity in world axes and rates in body axes; the rotation is that of the rest of the tool."""
    world = np.array([0.5, -0.25, 0.125])
    expected = np.asarray(rotation_from_quaternion(TURNED)).T @ world
    np.testing.assert_allclose(in_body_axes(TURNED, world), expected, rtol=0, atol=1e-15)
    place = mavlink.MAVLink_local_position_ned_message(2000, 1.0, 2.0, 3.0, *world)
    turn = mavlink.MAVLink_attitude_quaternion_message(1990, *TURNED, 0.01, 0.02, 0.03)
    found = of_local_position(place, turn)
    assert found.time_usec == 2_000_000
    np.testing.assert_array_equal(found.position, [1, 2, 3])
    np.testing.assert_allclose(found.velocity, [*expected, 0.01, 0.02, 0.03], rtol=0, atol=1e-15)


def test_a_position_waits_for_its_attitude():
    place = mavlink.MAVLink_local_position_ned_message(2000, 1.0, 2.0, 3.0, 0, 0, 0)
    reader = OdometryReader("local_position")
    assert reader.read(place) is None
    assert reader.read(mavlink.MAVLink_attitude_quaternion_message(1800, 1, 0, 0, 0, 0, 0, 0)) is None
    with pytest.raises(
        BadInput, match=r"`ATTITUDE_QUATERNION` must be within 0.1 s of LOCAL_POSITION_NED, but is 0.2 s"
    ):
        reader.read(place)
    reader.read(mavlink.MAVLink_attitude_quaternion_message(2050, 1, 0, 0, 0, 0, 0, 0))
    assert reader.read(place) is not None and reader.read(odometry()) is None
    with pytest.raises(BadInput, match="`input` must be one of odometry, local_position"):
        OdometryReader("gps")


PULSES = Pulses({1: 1900.0, 2: 1300.0, 8: 1500.4}, neutral=1500.0, span=400.0)


def test_rc_override():
    (found,) = map(through_the_wire, commands_of("rc_override", 8)(MavlinkTarget(7), PULSES, 0))
    assert found.get_type() == "RC_CHANNELS_OVERRIDE" and (found.target_system, found.target_component) == (7, 1)
    values = [getattr(found, f"chan{n}_raw") for n in range(1, 19)]
    assert values == [1900, 1300, 65535, 65535, 65535, 65535, 65535, 1500, *10 * [65535]]


def test_servo():
    found = list(map(through_the_wire, commands_of("servo", 8)(MavlinkTarget(7), PULSES, 0)))
    assert [(one.get_type(), one.command, one.param1, one.param2) for one in found] == [
        ("COMMAND_LONG", 183, 1, 1900),
        ("COMMAND_LONG", 183, 2, 1300),
        ("COMMAND_LONG", 183, 8, 1500),
    ]


def test_actuator():
    """Outputs 1 to 6 and 7 to 12; those that are no thrusters are left alone."""
    first, second = map(through_the_wire, commands_of("actuator", 8)(MavlinkTarget(7), PULSES, 0))
    values = [[one.param1, one.param2, one.param3, one.param4, one.param5, one.param6] for one in (first, second)]
    np.testing.assert_array_equal(values[0], [1, -0.5, np.nan, np.nan, np.nan, np.nan])
    np.testing.assert_allclose(values[1], [np.nan, 0.001, np.nan, np.nan, np.nan, np.nan], rtol=1e-4)
    assert first.command == second.command == 187 and (first.param7, second.param7) == (0, 1)


def test_control_target():
    (found,) = map(through_the_wire, commands_of("control_target", 8)(MavlinkTarget(7), PULSES, 123))
    assert found.get_type() == "SET_ACTUATOR_CONTROL_TARGET" and found.group_mlx == 0 and found.time_usec == 123
    np.testing.assert_allclose(found.controls, [1, -0.5, 0, 0, 0, 0, 0, 0.001], rtol=1e-4)


def test_outputs_that_are_none_or_reach_no_channel():
    with pytest.raises(BadInput, match="`output` must be one of rc_override, servo, actuator, control_target"):
        commands_of("pwm", 8)
    with pytest.raises(BadInput, match="`channels` must be at most 16 with rc_override, but is 17"):
        commands_of("rc_override", 17)
    with pytest.raises(BadInput, match="`channels` must be at most 12 with actuator, but is 13"):
        commands_of("actuator", 13)
