"""Logs of ArduPilot, PX4 and ROS 2, CSV and JSON: the same motion comes out of every format, in our frames and units."""

import numpy as np
import pytest
from other_programs import ardupilot_bin, json_mcap, px4_ulg, ros1_bag, ros2_bag
from scipy.spatial.transform import Rotation

from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.logs.mapping import mapping_of
from undertow.logs.motion import inputs_of, motion_of
from undertow.logs.read import read_log

ROWS = 40
TIME = np.linspace(0, 3.9, ROWS)
MICROSECONDS = np.round(TIME * 1e6).astype(int)
CHANCE = np.random.default_rng(0)

# The motion, in our frames: north, east, down; roll, pitch, yaw; u, v, w; p, q, r.
POSITION = CHANCE.normal(size=(ROWS, 3))
ANGLES = CHANCE.uniform(-1, 1, (ROWS, 3)) * [3.0, 1.4, 3.0]
BODY_VELOCITY, RATES, FORCE = (CHANCE.normal(size=(ROWS, 3)) for _ in range(3))
TURNED = Rotation.from_euler("ZYX", ANGLES[:, ::-1])  # FRD -> NED, by another's code
VELOCITY = TURNED.apply(BODY_VELOCITY)
PULSES = CHANCE.integers(1100, 1900, (ROWS, 8))

# Axes of ROS: x east, y north, z up; x forward, y port, z up (REP 103).
ENU_OF_NED = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLU_OF_FRD = np.diag([1, -1, -1])


def close(series, expected, tolerance=1e-6):
    np.testing.assert_allclose(series.values, expected, rtol=tolerance, atol=tolerance)


def same_turn(series, tolerance=1e-6):
    apart = Rotation.from_euler("ZYX", series.values[:, ::-1]) * TURNED.inv()
    assert apart.magnitude().max() < tolerance


def bin_file(path, clock=MICROSECONDS, core=("XKF1", "#")):
    """ATT in degrees, XKF1 with two cores, IMU with two sensors, BARO as a height, RCOU in us."""
    kind, instance = core
    degrees = np.degrees(ANGLES)
    rows = lambda *columns: [tuple(row) for row in zip(*columns, strict=True)]
    hundredths = [tuple(np.round(100 * row).astype(int)) for row in degrees]
    other = POSITION + 100
    tables = [
        ("ATT", "QccC", "TimeUS,Roll,Pitch,Yaw", "sddh", [(t, r, p, y % 36000) for t, (r, p, y) in zip(clock.tolist(), hundredths, strict=True)]),
        (
            kind,
            "QBcccffffff",
            "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,PN,PE,PD",
            f"s{instance}dddnnnmmm",
            [(t, c, *a, *v, *p) for c, place in ((0, POSITION), (1, other)) for t, a, v, p in rows(clock.tolist(), hundredths, VELOCITY, place)],
        ),
        (
            "IMU",
            "QBffffff",
            "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ",
            "s#EEEooo",
            [(t, i, *(w + i), *f) for i in (0, 1) for t, w, f in rows(clock.tolist(), RATES, FORCE)],
        ),
        ("BARO", "QBf", "TimeUS,I,Alt", "s#m", [(t, 0, -p[2]) for t, p in rows(clock.tolist(), POSITION)]),
        ("RCOU", "Q" + "H" * 14, "TimeUS," + ",".join(f"C{i}" for i in range(1, 15)), "s" + "Y" * 14, [(t, *p, *[0] * 6) for t, p in rows(clock.tolist(), PULSES.tolist())]),
    ]  # fmt: skip
    path.write_bytes(ardupilot_bin(tables))
    return path


def ulg_file(path, odometry=False, velocity=VELOCITY, frame=1):
    floats = lambda several: [tuple(map(float, row)) for row in several]
    quaternion = np.roll(TURNED.as_quat(), 1, axis=1)
    clock = MICROSECONDS.tolist()
    rows = lambda *columns: [(t + 7, t, *sum(rest, ())) for t, *rest in zip(clock, *map(floats, columns), strict=True)]
    head = "uint64_t timestamp;uint64_t timestamp_sample;"
    duty = (PULSES - 1500) / 400
    padded = np.hstack([duty, np.full((ROWS, 4), np.nan)])
    topics = [("actuator_motors", 0, head + "float[12] control;", rows(padded))]
    if odometry:
        flags = [(1, frame)] * ROWS
        mixed = [
            (t + 7, t, frame, *p, *q, other, *v, *w)
            for t, (frame, other), p, q, v, w in zip(
                clock, flags, floats(POSITION), floats(quaternion), floats(velocity), floats(RATES), strict=True
            )
        ]
        fields = "uint8_t pose_frame;float[3] position;float[4] q;uint8_t velocity_frame;float[3] velocity;float[3] angular_velocity;"
        topics.append(("vehicle_odometry", 0, head + fields, mixed))
    else:
        topics += [
            ("vehicle_local_position", 0, head + "float x;float y;float z;float vx;float vy;float vz;", rows(POSITION, VELOCITY)),
            ("vehicle_attitude", 0, head + "float[4] q;", rows(quaternion)),
            ("vehicle_angular_velocity", 0, head + "float[3] xyz;", rows(RATES)),
            ("vehicle_angular_velocity", 1, head + "float[3] xyz;", rows(RATES + 1)),
            ("sensor_combined", 0, "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", [(t, *w, *f) for t, w, f in zip(clock, floats(RATES), floats(FORCE), strict=True)]),
        ]  # fmt: skip
    path.write_bytes(px4_ulg(topics))
    return path


def test_old_px4(tmp_path):
    """Before vehicle_angular_velocity: rates in vehicle_attitude, or those of the gyro."""
    clock, floats = MICROSECONDS.tolist(), lambda several: [tuple(map(float, row)) for row in several]
    quaternion = floats(np.roll(TURNED.as_quat(), 1, axis=1))
    gyro = (
        "sensor_combined",
        0,
        "uint64_t timestamp;float[3] gyro_rad;",
        [(t, *w) for t, w in zip(clock, floats(RATES + 1), strict=True)],
    )
    fields = "uint64_t timestamp;float rollspeed;float pitchspeed;float yawspeed;float[4] q;"
    attitude = ("vehicle_attitude", 0, fields, [(t, *w, *q) for t, w, q in zip(clock, floats(RATES), quaternion, strict=True)])  # fmt: skip
    for topics, expected in (([gyro], RATES + 1), ([gyro, attitude], RATES)):
        (tmp_path / "old.ulg").write_bytes(px4_ulg(topics))
        close(read_log(tmp_path / "old.ulg")["angular_velocity"], expected)


def ros_messages():
    """Odometry and pulses, in the axes of ROS."""
    quaternion = np.roll(Rotation.from_matrix(ENU_OF_NED @ TURNED.as_matrix() @ FLU_OF_FRD).as_quat(), 1, axis=1)
    start = 1_700_000_000 * 10**9
    messages = []
    for i, ns in enumerate((MICROSECONDS * 1000).tolist()):
        given = {
            "position": ENU_OF_NED @ POSITION[i],
            "quaternion": quaternion[i],
            "linear": FLU_OF_FRD @ BODY_VELOCITY[i],
            "angular": FLU_OF_FRD @ RATES[i],
        }
        messages.append(("/odom", "nav_msgs/msg/Odometry", start + ns, given))
        messages.append(("/thrusters", "std_msgs/msg/Float64MultiArray", start + ns, {"data": PULSES[i]}))
    return messages


def bag(folder, storage):
    ros2_bag(folder, storage, ros_messages())
    return folder


@pytest.mark.parametrize("core", [("XKF1", "#"), ("NKF1", "-")])
def test_ardupilot(tmp_path, core):
    """The first of two cores and two sensors; degrees, centidegrees and heights become radians and depths."""
    log = read_log(bin_file(tmp_path / "dive.bin", core=core))
    assert log.format == "ArduPilot"
    np.testing.assert_allclose(log["attitude"].time, TIME, atol=1e-9)
    close(log["position"], POSITION)
    close(log["velocity"], VELOCITY)
    same_turn(log["attitude"], 3e-4)  # centidegrees
    close(log["angular_velocity"], RATES)
    close(log["specific_force"], FORCE)
    close(log["depth"], POSITION[:, 2])
    np.testing.assert_array_equal(log["pulses"].values[:, :8], PULSES)
    units = {name: series.unit for name, series in log.signals.items()}
    assert units["attitude"] == "rad" and units["angular_velocity"] == "rad/s" and units["pulses"] == "us"


def test_a_signal_that_is_missing_is_mapped(tmp_path):
    """The error lists what the log has and shows the entry of a mapping, which then gives the signal."""
    log = read_log(bin_file(tmp_path / "dive.bin"))
    with pytest.raises(BadInput) as refused:
        inputs_of(log, ("input", "commanded_input"))
    assert str(refused.value) == (
        "`log` must have the signal `input` or `commanded_input`, but is dive.bin, which has position, velocity, "
        "attitude, angular_velocity, specific_force, depth, pulses. Add it to the mapping with which the file is read, "
        "or was converted: `signals: {input: {frame: vectored_6dof, unit: us, supply: 16}}`, with the frame of the "
        "vehicle (FRAME_CONFIG); `supply` is in V"
    )
    entry = {"topic": "RCOU", "columns": ["C1", "C2"], "unit": "us", "supply": 16}
    mapped = read_log(tmp_path / "dive.bin", mapping_of({"signals": {"input": entry}}))
    offset = PULSES[:, :2] - 1500
    close(inputs_of(mapped), np.where(abs(offset) > 25, offset / 25, 0.0), 1e-12)
    kept = {name: series for name, series in log.signals.items() if name in ("position", "attitude", "velocity")}
    with pytest.raises(
        BadInput, match=r"which has position, velocity, attitude\. Add it.*: `signals: \{angular_velocity:"
    ):
        motion_of(Log(kept, "dive.csv", "CSV"))
    with pytest.raises(BadInput, match=r"Did you mean `attitude`\?"):
        log["atitude"]


def test_ardupilot_as_pymavlink_reads_it(tmp_path):
    """Every number of every message, by the reader of ArduPilot's own tools."""
    from pymavlink.DFReader import DFReader_binary

    from undertow.logs.ardupilot import read_ardupilot

    path = bin_file(tmp_path / "dive.bin")
    tables, found = read_ardupilot(path).tables, {}
    with DFReader_binary(str(path), zero_time_base=True) as reader:
        while (message := reader.recv_msg()) is not None:
            kind, instance = message.get_type(), message.fmt.instance_field
            topic = kind if instance is None else f"{kind}[{getattr(message, instance)}]"
            found.setdefault(topic, []).append({name: getattr(message, name) for name in message.get_fieldnames()})
    assert set(tables) - {"FMTU"} == {"ATT", "XKF1[0]", "XKF1[1]", "IMU[0]", "IMU[1]", "BARO[0]", "RCOU"}
    for topic in set(tables) - {"FMTU"}:
        assert list(tables[topic].fields) == list(found[topic][0])
        for name, values in tables[topic].fields.items():
            np.testing.assert_array_equal(
                values, [message[name] for message in found[topic]], err_msg=f"{topic}.{name}"
            )


@pytest.mark.parametrize("odometry", [False, True])
def test_px4(tmp_path, odometry):
    log = read_log(ulg_file(tmp_path / "dive.ulg", odometry))
    np.testing.assert_allclose(log["position"].time, TIME, atol=1e-9)
    close(log["position"], POSITION)
    close(log["velocity"], VELOCITY)
    same_turn(log["attitude"])
    close(log["angular_velocity"], RATES)
    close(log["duty"]._replace(values=log["duty"].values[:, :8]), (PULSES - 1500) / 400)


@pytest.mark.parametrize(("frame", "read"), [(1, "velocity"), (3, "body_velocity"), (2, "")])
def test_px4_odometry_says_its_frame(tmp_path, frame, read):
    """1 is NED and 3 FRD of the body; 2, with any heading, is left out with a note."""
    velocity = BODY_VELOCITY if frame == 3 else VELOCITY
    log = read_log(ulg_file(tmp_path / "dive.ulg", odometry=True, velocity=velocity, frame=frame))
    assert [name for name in ("velocity", "body_velocity") if name in log] == [read] * bool(read)
    if read:
        close(log[read], velocity)
    else:
        assert "vehicle_odometry is not read as velocity: its velocity_frame is 2, not 1" in log.notes


THRUSTERS = {"input": {"topic": "/thrusters", "columns": ["data[0]..data[7]"], "unit": "us", "supply": 16}}


def same_motion_of_ros(path):
    """East, north, up and forward, port, up become ours; times begin at the first message."""
    log = read_log(path, mapping_of({"signals": THRUSTERS}))
    np.testing.assert_allclose(log["position"].time, TIME, atol=1e-9)
    close(log["position"], POSITION, 1e-12)
    same_turn(log["attitude"], 1e-9)
    close(log["body_velocity"], BODY_VELOCITY, 1e-12)
    close(log["angular_velocity"], RATES, 1e-12)
    offset = PULSES - 1500
    close(log["input"], np.where(abs(offset) > 25, offset / 25, 0.0), 1e-12)
    assert not log.notes
    return log


@pytest.mark.full
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_ros2(tmp_path, storage):
    folder = bag(tmp_path / "bag", storage)
    file = next(one for one in folder.iterdir() if one.suffix in (".mcap", ".db3"))
    for path in (folder, file):
        assert same_motion_of_ros(path).format == "ROS 2 bag"


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_ros1(tmp_path, compression):
    path = ros1_bag(tmp_path / "dive.bag", ros_messages(), compression, chunk_size=2**14)
    assert same_motion_of_ros(path).format == "ROS 1 bag"


def test_csv_with_any_header(tmp_path):
    """Milliseconds, degrees, centimetres, ENU and FLU, semicolons."""
    enu, flu = POSITION @ ENU_OF_NED.T, RATES @ FLU_OF_FRD.T
    turned = Rotation.from_matrix(ENU_OF_NED @ TURNED.as_matrix() @ FLU_OF_FRD).as_euler("ZYX", degrees=True)[:, ::-1]
    table = np.column_stack([1000 * TIME, 100 * enu, turned, np.degrees(flu), PULSES, -POSITION[:, 2]])
    names = "ms;x;y;z;r;p;h;gx;gy;gz;" + ";".join(f"pwm{i}" for i in range(1, 9)) + ";alt"
    text = "\n".join([names, *(";".join(map(repr, row)) for row in table.tolist())])
    (tmp_path / "dive.csv").write_text(text)
    mapping = mapping_of(
        {
            "time": {"column": "ms", "unit": "ms"},
            "world": "ENU",
            "body": "FLU",
            "signals": {
                "position": {"columns": ["x", "y", "z"], "unit": "cm"},
                "attitude": {"columns": ["r", "p", "h"], "unit": "deg"},
                "angular_velocity": {"columns": ["gx", "gy", "gz"], "unit": "deg/s"},
                "pulses": {"columns": ["pwm1..pwm8"]},
                "depth": {"columns": "alt"},
            },
        }
    )
    log = read_log(tmp_path / "dive.csv", mapping)
    np.testing.assert_allclose(log["position"].time, TIME, atol=1e-12)
    close(log["position"], POSITION, 1e-12)
    same_turn(log["attitude"], 1e-9)
    close(log["angular_velocity"], RATES, 1e-12)
    close(log["depth"], POSITION[:, 2], 1e-12)
    np.testing.assert_array_equal(log["pulses"].values, PULSES)


def test_columns_of_text_in_a_csv_file(tmp_path):
    """Clock times and words refuse the file only where a mapping names their column."""
    rows = "".join(f"{k},10:50:{k:02d},{'ROV' if k else ''},{k / 2}\n" for k in range(10))
    (tmp_path / "dive.csv").write_text("s,clock,name,depth\n" + rows)
    signals = {"signals": {"depth": {"columns": "depth"}}}
    log = read_log(tmp_path / "dive.csv", mapping_of(signals | {"time": "s"}))
    close(log["depth"], np.arange(10) / 2)
    assert log.notes == ("columns of text are left out: clock, name",)
    with pytest.raises(
        BadInput, match=r"time.column` must hold numbers, but is dive.csv, line 2, column clock: 10:50:00"
    ):
        read_log(tmp_path / "dive.csv", mapping_of(signals | {"time": "clock"}))
    with pytest.raises(BadInput, match=r"columns` must hold numbers, but is dive.csv, line 3, column name: ROV"):
        read_log(tmp_path / "dive.csv", mapping_of({"time": "s", "signals": {"depth": {"columns": "name"}}}))


def test_json_of_others(tmp_path):
    messages = [
        (int(t) * 1000, {"pose": {"x": p[0], "y": p[1], "z": p[2]}, "good": True, "name": "a"})
        for t, p in zip(MICROSECONDS, POSITION.tolist(), strict=True)
    ]
    json_mcap(tmp_path / "dive.mcap", {"/pose": messages})
    log = read_log(
        tmp_path / "dive.mcap",
        mapping_of({"signals": {"position": {"topic": "/pose", "columns": ["pose.x", "pose.y", "pose.z"]}}}),
    )
    close(log["position"], POSITION, 1e-15)
    np.testing.assert_allclose(log["position"].time, TIME, atol=1e-9)
