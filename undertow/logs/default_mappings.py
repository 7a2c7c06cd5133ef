"""What the messages of ArduPilot, PX4 and ROS 2 mean, from their definitions.

ArduPilot: ardupilot.org/sub/docs/logmessages.html and the LogStructure.h of each library. PX4: docs.px4.io/main/en/
msg_docs. ROS 2: REP 103 (units, axes) and nav_msgs/Odometry, whose twist is in the axes of the body.
"""

from undertow.logs.mapping import Entry, LogMapping

_ENU = ("ENU", "FLU")


def _xyz(path: str) -> tuple[str, ...]:
    return tuple(f"{path}.{axis}" for axis in "xyz")


def _indexed(name: str, number: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i}]" for i in range(number))


# Positions are relative to the origin of the estimator; ATT and XKF1 in degrees; RCOU in us; the gyro in rad/s and the
# accelerometer in m/s^2 along FRD; BARO.Alt is a height, m, so that its depth points up.
_EKF = tuple(
    (Entry(("PN", "PE", "PD"), kind), Entry(("VN", "VE", "VD"), kind), Entry(("Roll", "Pitch", "Yaw"), kind, "deg"))
    for kind in ("XKF1", "NKF1")
)
ARDUPILOT = LogMapping(
    {
        "position": tuple(position for position, _, _ in _EKF),
        "velocity": tuple(velocity for _, velocity, _ in _EKF),
        "attitude": (Entry(("Roll", "Pitch", "Yaw"), "ATT", "deg"), *(attitude for _, _, attitude in _EKF)),
        "angular_velocity": (Entry(("GyrX", "GyrY", "GyrZ"), "IMU", "rad/s"),),
        "specific_force": (Entry(("AccX", "AccY", "AccZ"), "IMU"),),
        "depth": (Entry(("Alt",), "BARO", frame=_ENU), Entry(("Alt",), "CTUN", frame=_ENU)),
        "pulses": tuple(Entry(tuple(f"C{i}" for i in range(1, most + 1)), "RCOU") for most in (14, 12, 8)),
    }
)

# vehicle_local_position: NED; vehicle_attitude.q: w, x, y, z, FRD to NED; vehicle_odometry has pose_frame 1 for NED,
# and velocity_frame 1 for NED, 3 for FRD of the body; actuator_motors.control: from -1 to 1, NaN while disarmed.
PX4 = LogMapping(
    {
        "position": (
            Entry(("x", "y", "z"), "vehicle_local_position"),
            Entry(_indexed("position", 3), "vehicle_odometry", must=(("pose_frame", 1.0),)),
            Entry(("x", "y", "z"), "vehicle_odometry", must=(("local_frame", 0.0),)),
        ),
        "velocity": (
            Entry(("vx", "vy", "vz"), "vehicle_local_position"),
            Entry(_indexed("velocity", 3), "vehicle_odometry", must=(("velocity_frame", 1.0),)),
        ),
        "body_velocity": (Entry(_indexed("velocity", 3), "vehicle_odometry", must=(("velocity_frame", 3.0),)),),
        "quaternion": (
            Entry(_indexed("q", 4), "vehicle_attitude"),
            Entry(_indexed("q", 4), "vehicle_odometry", must=(("pose_frame", 1.0),)),
        ),
        "angular_velocity": (
            Entry(_indexed("xyz", 3), "vehicle_angular_velocity"),
            Entry(_indexed("angular_velocity", 3), "vehicle_odometry"),
            Entry(("rollspeed", "pitchspeed", "yawspeed"), "vehicle_odometry"),
        ),
        "specific_force": (Entry(_indexed("accelerometer_m_s2", 3), "sensor_combined"),),
        "duty": (Entry(_indexed("control", 12), "actuator_motors"),),
        "pulses": (Entry(_indexed("output", 16), "actuator_outputs"),),
    }
)

_ODOMETRY, _IMU = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu"
_TWIST = "twist.twist"
ROS2 = LogMapping(
    {
        "position": (Entry(_xyz("pose.pose.position"), _ODOMETRY, frame=_ENU),),
        "quaternion": (
            Entry(tuple(f"pose.pose.orientation.{axis}" for axis in "wxyz"), _ODOMETRY, frame=_ENU),
            Entry(tuple(f"orientation.{axis}" for axis in "wxyz"), _IMU, frame=_ENU),
        ),
        "body_velocity": (Entry(_xyz(f"{_TWIST}.linear"), _ODOMETRY, frame=_ENU),),
        "angular_velocity": (
            Entry(_xyz(f"{_TWIST}.angular"), _ODOMETRY, frame=_ENU),
            Entry(_xyz("angular_velocity"), _IMU, frame=_ENU),
        ),
        "specific_force": (Entry(_xyz("linear_acceleration"), _IMU, frame=_ENU),),
    }
)

DEFAULTS = {"ArduPilot": ARDUPILOT, "PX4": PX4, "ROS 2 bag": ROS2}
