"""Telemetry logs of ground stations: the vehicle's messages, by its own clock; what is whole of damaged files."""

import struct

import numpy as np
import pytest
from other_programs import mavlink_tlog

from undertow.core.errors import BadInput
from undertow.logs.mapping import mapping_of
from undertow.logs.mavlink_log import read_mavlink
from undertow.logs.read import read_log

ROWS = 60
VEHICLE, STATION, CAMERA = (1, 1), (255, 190), (1, 100)
START, BOOT = 1_700_000_000_000_000, 4_294_000  # us of the ground station; ms since the vehicle started
CHANCE = np.random.default_rng(5)
POSITION, VELOCITY, ANGLES, RATES = (CHANCE.uniform(-1, 1, (ROWS, 3)).astype(np.float32) for _ in range(4))
PULSES = CHANCE.integers(1100, 1900, (ROWS, 8))
DELAY = CHANCE.integers(3000, 40_000, ROWS)  # us, of the link
DELAY[17] = 1000


def dive(boot=BOOT, start=START):
    """One second in 60 samples: motion, pulses, and what else there is on a link."""
    yield start, STATION, "HEARTBEAT", {"autopilot": 8}
    yield start, CAMERA, "HEARTBEAT", {"autopilot": 8}
    yield start, VEHICLE, "HEARTBEAT", {"autopilot": 3}
    for channel in range(1, 9):
        yield (
            start,
            VEHICLE,
            "PARAM_VALUE",
            {"param_id": f"SERVO{channel}_FUNCTION".encode(), "param_value": 32 + channel},
        )
    for k in range(ROWS):
        clock = boot + 50 * k
        us = start + 50_000 * k + int(DELAY[k])
        p, v, a, w = (row[k].tolist() for row in (POSITION, VELOCITY, ANGLES, RATES))
        yield us, STATION, "ATTITUDE", {"time_boot_ms": k, "roll": 9.0}
        yield (
            us,
            VEHICLE,
            "ATTITUDE",
            dict(zip(("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"), a + w, strict=True))
            | {"time_boot_ms": clock},
        )
        yield (
            us,
            VEHICLE,
            "LOCAL_POSITION_NED",
            dict(zip(("x", "y", "z", "vx", "vy", "vz"), p + v, strict=True)) | {"time_boot_ms": clock},
        )
        yield us, VEHICLE, "GLOBAL_POSITION_INT", {"time_boot_ms": clock, "relative_alt": round(-1000 * p[2])}
        servos = {f"servo{i + 1}_raw": int(pulse) for i, pulse in enumerate(PULSES[k])}
        yield us, VEHICLE, "SERVO_OUTPUT_RAW", servos | {"time_usec": 1000 * clock % 2**32, "servo9_raw": 1100}
        yield us, VEHICLE, "RAW_IMU", {"time_usec": 1000 * clock, "zacc": -1000}
        yield us, VEHICLE, "VFR_HUD", {"alt": -p[2]}  # fmt: skip


def tlog_file(path, version=2):
    path.write_bytes(mavlink_tlog(dive(), version))
    return path


@pytest.mark.parametrize("version", [1, 2])
def test_a_telemetry_log(tmp_path, version):
    """Values of the autopilot, not of the ground station; times 50 ms apart whatever the link's delay; pulses too,
    whose microseconds of 32 bits begin again within the log."""
    log = read_log(tlog_file(tmp_path / "dive.tlog", version))
    assert log.format == "MAVLink"
    np.testing.assert_array_equal(log["position"].values, POSITION)
    np.testing.assert_array_equal(log["velocity"].values, VELOCITY)
    np.testing.assert_array_equal(log["attitude"].values, ANGLES)
    np.testing.assert_array_equal(log["angular_velocity"].values, RATES)
    np.testing.assert_allclose(log["depth"].values, POSITION[:, 2], atol=1e-3)
    np.testing.assert_array_equal(log["pulses"].values, PULSES)
    np.testing.assert_allclose(log["specific_force"].values[:, 2], -9.80665)
    for name in log.signals:
        np.testing.assert_allclose(log[name].time, 1e-3 + 0.05 * np.arange(ROWS), atol=1e-6, err_msg=name)
    assert log.notes == (
        "SERVO_OUTPUT_RAW " + ", ".join(f"servo{i}_raw" for i in range(9, 17)) + " are no pulses of motors "
        "(SERVOn_FUNCTION) and are left out",
    )


def test_motors_of_a_telemetry_log(tmp_path):
    signals = {"input": {"frame": "vectored_6dof", "unit": "us", "supply": 16, "dead_band": 0}}
    log = read_log(tlog_file(tmp_path / "dive.tlog"), mapping_of({"signals": signals}))
    np.testing.assert_allclose(log["input"].values, (PULSES - 1500) / 400 * 16)
    assert log["input"].columns[7] == "motor 8 of vectored_6dof"


def test_as_pymavlink_reads_it(tmp_path):
    """Every number of every message of every sender, by the reader of ArduPilot's own tools."""
    from pymavlink import mavutil

    path = tlog_file(tmp_path / "dive.tlog")
    tables, messages = read_mavlink(path).tables, {}
    reader = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    while (message := reader.recv_msg()) is not None:
        sender = message.get_srcSystem(), message.get_srcComponent()
        topic = message.get_type() + ("" if sender == VEHICLE else f"[{sender[0]}:{sender[1]}]")
        messages.setdefault(topic, []).append(message)
    assert set(tables) == set(messages)
    for topic, table in tables.items():
        for name, values in table.fields.items():
            np.testing.assert_array_equal(values, [getattr(one, name) for one in messages[topic]], err_msg=topic)


def test_the_vehicle_starts_again(tmp_path):
    """Its clock begins again; the times of the log go on."""
    again = dive(boot=500, start=START + 10_000_000)
    (tmp_path / "a.tlog").write_bytes(mavlink_tlog([*dive(), *again]))
    log = read_log(tmp_path / "a.tlog")
    expected = np.concatenate([1e-3 + 0.05 * np.arange(ROWS), 10.001 + 0.05 * np.arange(ROWS)])
    np.testing.assert_allclose(log["position"].time, expected, atol=1e-6)
    np.testing.assert_allclose(log["pulses"].time, expected, atol=1e-6)
    assert "the vehicle started again 1 times" in log.notes


def test_messages_that_come_twice_or_late(tmp_path):
    """Two links bring the same message, and one comes after the next."""
    messages = list(dive())
    place = [i for i, (_, sender, name, _) in enumerate(messages) if sender == VEHICLE and name == "LOCAL_POSITION_NED"]
    messages.insert(place[30], messages[place[29]])
    messages[place[10]], messages[place[11]] = messages[place[11]], messages[place[10]]
    (tmp_path / "a.tlog").write_bytes(mavlink_tlog(messages))
    log = read_log(tmp_path / "a.tlog")
    np.testing.assert_array_equal(log["position"].values, POSITION)
    assert "LOCAL_POSITION_NED: 1 samples of the time of the one before are left out" in log.notes


def test_what_is_whole_of_a_damaged_file(tmp_path):
    """Bytes changed in one frame, noise between two, the end cut off; signed frames and those of another dialect."""
    whole = tlog_file(tmp_path / "a.tlog").read_bytes()
    frames = read_mavlink(tmp_path / "a.tlog").tables
    assert len(frames["ATTITUDE"].time) == ROWS
    ends = [i for i in range(len(whole)) if whole[i : i + 2] == struct.pack(">Q", START)[:2] and whole[i + 8] == 0xFD]
    place = ends[100]
    damaged = bytearray(whole[:-7])
    damaged[place + 24] ^= 0x55
    foreign = struct.pack(">Q", START) + b"\xfd\x05\x00\x00\x00\x01\x01" + (60_000).to_bytes(3, "little") + bytes(7)
    damaged[ends[150] : ends[150]] = foreign
    damaged[ends[120] : ends[120]] = bytes(range(200))
    (tmp_path / "a.tlog").write_bytes(damaged)
    log = read_log(tmp_path / "a.tlog")
    tables = read_mavlink(tmp_path / "a.tlog").tables
    missing = sum(len(table.time) for table in frames.values()) - sum(len(table.time) for table in tables.values())
    assert missing == 2  # the damaged one, and the last
    assert f"of {len(damaged)} bytes belong to no whole frame, and are left out" in log.notes[0]


def test_a_damaged_time(tmp_path):
    """No checksum covers it: the frame counts with the time of its neighbours."""
    whole = bytearray(tlog_file(tmp_path / "a.tlog").read_bytes())
    begins = [i for i in range(len(whole)) if whole[i : i + 2] == struct.pack(">Q", START)[:2] and whole[i + 8] == 0xFD]
    for place in (begins[0], begins[100], begins[200]):
        whole[place + 2] ^= 0x04
    (tmp_path / "a.tlog").write_bytes(whole)
    log = read_log(tmp_path / "a.tlog")
    np.testing.assert_allclose(log["position"].time, 1e-3 + 0.05 * np.arange(ROWS), atol=1e-6)
    assert log.notes[0] == "3 frames have damaged times, and are given those of others"


@pytest.mark.parametrize("data", [b"", b"text, not frames", bytes(1000), b"\xfd" * 1000])
def test_files_without_frames(tmp_path, data):
    (tmp_path / "a.tlog").write_bytes(data)
    with pytest.raises(
        BadInput, match=r"be a .tlog file of MAVLink, but is a.tlog, without a whole frame in \d+ bytes"
    ):
        read_log(tmp_path / "a.tlog")
