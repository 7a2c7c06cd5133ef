"""What the messages of ArduPilot, PX4 and ROS mean, from their definitions.

ArduPilot: ardupilot.org/sub/docs/logmessages.html and the LogStructure.h of each library. PX4: docs.px4.io/main/en/
msg_docs. ROS 1 and 2: REP 103 (units, axes) and nav_msgs/Odometry, whose twist is in the axes of the body.
"""

from undertow.logs.ardupilot_parameters import barometers, motor_channels, primary_barometer, pulse_columns
from undertow.logs.mapping import LogMapping, SignalMapping
from undertow.logs.recording import Recording

_ENU = ("ENU", "FLU")


def _xyz(path: str) -> tuple[str, ...]:
    return tuple(f"{path}.{axis}" for axis in "xyz")


def _indexed(name: str, number: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i}]" for i in range(number))


# Positions are relative to the origin of the estimator; ATT and XKF1 in degrees; RCOU in us; the gyro in rad/s and the
# accelerometer in m/s^2 along FRD; BARO.Alt, and CTUN.BAlt of the primary barometer, are heights, m, so that their
# depth points up.
_EKF = tuple(
    (
        SignalMapping(("PN", "PE", "PD"), kind),
        SignalMapping(("VN", "VE", "VD"), kind),
        SignalMapping(("Roll", "Pitch", "Yaw"), kind, "deg"),
    )
    for kind in ("XKF1", "NKF1")
)
_HEIGHTS = (("BAlt", "CTUN"), ("Alt", "BARO"), ("Alt", "CTUN"))
ARDUPILOT = LogMapping(
    {
        "position": tuple(position for position, _, _ in _EKF),
        "velocity": tuple(velocity for _, velocity, _ in _EKF),
        "attitude": (SignalMapping(("Roll", "Pitch", "Yaw"), "ATT", "deg"), *(attitude for _, _, attitude in _EKF)),
        "angular_velocity": (SignalMapping(("GyrX", "GyrY", "GyrZ"), "IMU", "rad/s"),),
        "specific_force": (SignalMapping(("AccX", "AccY", "AccZ"), "IMU"),),
        "depth": tuple(SignalMapping((column,), kind, frame=_ENU) for column, kind in _HEIGHTS),
        "pulses": tuple(SignalMapping(tuple(f"C{i}" for i in range(1, most + 1)), "RCOU") for most in (14, 12, 8)),
    }
)

# vehicle_local_position: NED; vehicle_attitude.q: w, x, y, z, FRD to NED; vehicle_odometry has pose_frame 1 for NED,
# and velocity_frame 1 for NED, 3 for FRD of the body; actuator_motors.control: from -1 to 1, NaN while disarmed. Old
# files have the rates of the body in vehicle_attitude; those of the gyro have its bias.
_SPEEDS = ("rollspeed", "pitchspeed", "yawspeed")
PX4 = LogMapping(
    {
        "position": (
            SignalMapping(("x", "y", "z"), "vehicle_local_position"),
            SignalMapping(_indexed("position", 3), "vehicle_odometry", must=(("pose_frame", 1.0),)),
            SignalMapping(("x", "y", "z"), "vehicle_odometry", must=(("local_frame", 0.0),)),
        ),
        "velocity": (
            SignalMapping(("vx", "vy", "vz"), "vehicle_local_position"),
            SignalMapping(_indexed("velocity", 3), "vehicle_odometry", must=(("velocity_frame", 1.0),)),
        ),
        "body_velocity": (SignalMapping(_indexed("velocity", 3), "vehicle_odometry", must=(("velocity_frame", 3.0),)),),
        "quaternion": (
            SignalMapping(_indexed("q", 4), "vehicle_attitude"),
            SignalMapping(_indexed("q", 4), "vehicle_odometry", must=(("pose_frame", 1.0),)),
        ),
        "angular_velocity": (
            SignalMapping(_indexed("xyz", 3), "vehicle_angular_velocity"),
            SignalMapping(_indexed("angular_velocity", 3), "vehicle_odometry"),
            SignalMapping(_SPEEDS, "vehicle_odometry"),
            SignalMapping(_SPEEDS, "vehicle_attitude"),
            SignalMapping(_indexed("gyro_rad", 3), "sensor_combined"),
        ),
        "specific_force": (SignalMapping(_indexed("accelerometer_m_s2", 3), "sensor_combined"),),
        "duty": (SignalMapping(_indexed("control", 12), "actuator_motors"),),
        "pulses": (SignalMapping(_indexed("output", 16), "actuator_outputs"),),
    }
)

_ODOMETRY, _IMU = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu"
_TWIST = "twist.twist"
ROS = LogMapping(
    {
        "position": (SignalMapping(_xyz("pose.pose.position"), _ODOMETRY, frame=_ENU),),
        "quaternion": (
            SignalMapping(tuple(f"pose.pose.orientation.{axis}" for axis in "wxyz"), _ODOMETRY, frame=_ENU),
            SignalMapping(tuple(f"orientation.{axis}" for axis in "wxyz"), _IMU, frame=_ENU),
        ),
        "body_velocity": (SignalMapping(_xyz(f"{_TWIST}.linear"), _ODOMETRY, frame=_ENU),),
        "angular_velocity": (
            SignalMapping(_xyz(f"{_TWIST}.angular"), _ODOMETRY, frame=_ENU),
            SignalMapping(_xyz("angular_velocity"), _IMU, frame=_ENU),
        ),
        "specific_force": (SignalMapping(_xyz("linear_acceleration"), _IMU, frame=_ENU),),
    }
)

_ACCELERATIONS = ("xacc", "yacc", "zacc")


def _servos(most: int) -> tuple[str, ...]:
    return tuple(f"servo{i}_raw" for i in range(1, most + 1))


# LOCAL_POSITION_NED in m; ATTITUDE in rad, with the rates of the body; accelerations in m/s^2 or mg (those of RAW_IMU
# as ArduPilot sends them); relative_alt in mm above home, so that its depth points up; pulses in us.
MAVLINK = LogMapping(
    {
        "position": (SignalMapping(("x", "y", "z"), "LOCAL_POSITION_NED"),),
        "velocity": (SignalMapping(("vx", "vy", "vz"), "LOCAL_POSITION_NED"),),
        "attitude": (SignalMapping(("roll", "pitch", "yaw"), "ATTITUDE"),),
        "angular_velocity": (SignalMapping(_SPEEDS, "ATTITUDE"),),
        "specific_force": (
            SignalMapping(_ACCELERATIONS, "HIGHRES_IMU"),
            SignalMapping(_ACCELERATIONS, "RAW_IMU", "mg"),
            SignalMapping(_ACCELERATIONS, "SCALED_IMU", "mg"),
        ),
        "depth": (SignalMapping(("relative_alt",), "GLOBAL_POSITION_INT", "mm", frame=_ENU),),
        "pulses": tuple(
            SignalMapping(tuple(f"servo{i}_raw" for i in range(1, most + 1)), "SERVO_OUTPUT_RAW") for most in (16, 8)
        ),
    }
)

DEFAULTS = {"ArduPilot": ARDUPILOT, "PX4": PX4, "ROS 1 bag": ROS, "ROS 2 bag": ROS, "MAVLink": MAVLINK}


def usual_mapping(recording: Recording) -> tuple[LogMapping, tuple[str, ...]]:
    """What the messages of a file mean, and what a reader should know of it.

    The parameters of an ArduPilot vehicle say which barometer is in the water, and which channels drive motors.
    """
    mapping = DEFAULTS.get(recording.format, LogMapping({}))
    if recording.format not in ("ArduPilot", "MAVLink"):
        return mapping, ()
    signals = dict(mapping.signals)
    notes = []
    if recording.format == "ArduPilot":
        entries, note = _depth(recording)
        signals["depth"] = entries + signals["depth"]
        notes = [note] if note else []
    entries, note = _pulses(recording)
    signals["pulses"] = entries + signals["pulses"]
    return mapping._replace(signals=signals), tuple(notes + [note] if note else notes)


def _depth(recording: Recording) -> tuple[tuple[SignalMapping, ...], str]:
    """Where the depth of an ArduPilot log stands, before CTUN, and a note where that is a guess."""
    present, primary = barometers(recording), primary_barometer(recording)
    height = recording.find("CTUN")
    if primary or (primary is None and len(present) == 1):
        return (SignalMapping(("Alt",), primary or present[0], frame=_ENU),), ""
    if (height is not None and "BAlt" in height[1].fields) or len(present) < 2:
        return (), ""
    guess = f"{present[0]} is read as depth, the first of {', '.join(present)}"
    return (), f"{guess}: no parameter BARO_PRIMARY of the file says which of them is in the water"


def _pulses(recording: Recording) -> tuple[tuple[SignalMapping, ...], str]:
    """The pulses of the motors in their order, where the parameters tell motors from lights and cameras."""
    topic, columns = pulse_columns(recording)
    channels = [channel for channel in motor_channels(recording.parameters).values() if channel in columns]
    if not channels:
        return (), ""
    other_columns = [column for channel, column in columns.items() if channel not in channels]
    note = (
        f"{topic} {', '.join(other_columns)} are no pulses of motors (SERVOn_FUNCTION) and are left out"
        if other_columns
        else ""
    )
    return (SignalMapping(tuple(columns[channel] for channel in channels), topic),), note
