"""Parameters in a log of ArduSub: which barometer is in the water, which channels drive motors, and which way."""

import numpy as np
import pytest
from other_programs import ardupilot_bin

import undertow as ut
from undertow.core.errors import BadInput
from undertow.logs.mapping import mapping_of
from undertow.logs.motion import inputs_of
from undertow.logs.read import read_log

CLOCK = np.arange(30) * 100_000
HULL, WATER = 9.5 + 0.01 * np.arange(30), 2.0 + 0.1 * np.arange(30)  # depths that the two barometers give, m
SHARES = np.random.default_rng(1).uniform(-0.9, 0.9, (30, 8))  # of each motor, in its own direction

# Motors 1 to 8 on channels 3, 4, ..., 8, 1, 2, lights on 9 and 10, the camera on 11; three motors run the other way.
CHANNEL_OF_MOTOR = np.array([3, 4, 5, 6, 7, 8, 1, 2])
DIRECTION = np.array([1, -1, 1, 1, -1, 1, 1, -1])
SERVOS = {f"SERVO{channel}_FUNCTION": 33 + i for i, channel in enumerate(CHANNEL_OF_MOTOR.tolist())}
SERVOS |= {"SERVO9_FUNCTION": 181, "SERVO10_FUNCTION": 181, "SERVO11_FUNCTION": 7}
SERVOS |= {f"MOT_{i + 1}_DIRECTION": sign for i, sign in enumerate(DIRECTION.tolist())}


def barometers(*names):
    """BARO of before 2021, one message per barometer, or BARO with a number."""
    if names:
        return [(name, "Qf", "TimeUS,Alt", "sm", list(zip(CLOCK.tolist(), (-depth).tolist(), strict=True))) for name, depth in zip(names, (HULL, WATER), strict=True)]  # fmt: skip
    rows = [(t, i, -depth[k]) for k, t in enumerate(CLOCK.tolist()) for i, depth in enumerate((HULL, WATER))]
    return [("BARO", "QBf", "TimeUS,I,Alt", "s#m", rows)]


def parameters(**values):
    rows = [(0, name.encode(), float(value)) for name, value in values.items()]
    return ("PARM", "QNf", "TimeUS,Name,Value", "s--", rows)


def outputs():
    pulses = np.zeros((30, 14))
    pulses[:, CHANNEL_OF_MOTOR - 1] = 1500 + np.round(400 * SHARES * DIRECTION)
    pulses[:, 8:11] = 1100, 1100, 1900
    rows = [(t, *row) for t, row in zip(CLOCK.tolist(), pulses.astype(int).tolist(), strict=True)]
    return ("RCOU", "Q" + "H" * 14, "TimeUS," + ",".join(f"C{i}" for i in range(1, 15)), "s" + "Y" * 14, rows)


def read(tmp_path, *tables, signals=None):
    path = tmp_path / "dive.bin"
    path.write_bytes(ardupilot_bin(list(tables)))
    return read_log(path, mapping_of({"signals": signals}) if signals else None)


@pytest.mark.parametrize(
    ("names", "given"), [((), {"BARO_PRIMARY": 1}), (("BARO", "BAR2"), {"GND_PRIMARY": 1, "BARO_ALT_OFFSET": 0})]
)
def test_depth_is_that_of_the_primary_barometer(tmp_path, names, given):
    log = read(tmp_path, *barometers(*names), parameters(**given))
    np.testing.assert_allclose(log["depth"].values, WATER, atol=1e-6)
    assert log["depth"].origin == f"{names[1] if names else 'BARO[1]'} Alt (m, up)" and not log.notes


def test_the_last_value_of_a_parameter_counts(tmp_path):
    name, form, columns, units, rows = parameters(BARO_PRIMARY=0)
    rows.append((50_000, b"BARO_PRIMARY", 1.0))
    log = read(tmp_path, *barometers(), (name, form, columns, units, rows))
    np.testing.assert_allclose(log["depth"].values, WATER, atol=1e-6)


def test_depth_without_the_parameter(tmp_path):
    """CTUN has the height of the primary barometer; without it the first one is a guess, which a note says."""
    height = (
        "CTUN",
        "Qff",
        "TimeUS,Alt,BAlt",
        "smm",
        [(t, 7.0, -d) for t, d in zip(CLOCK.tolist(), WATER, strict=True)],
    )
    log = read(tmp_path, *barometers(), height)
    np.testing.assert_allclose(log["depth"].values, WATER, atol=1e-6)
    guess = read(tmp_path, *barometers())
    np.testing.assert_allclose(guess["depth"].values, HULL, atol=1e-6)
    assert "BARO[0] is read as depth, the first of BARO[0], BARO[1]" in guess.notes[0]
    lost = read(tmp_path, *barometers(), height, parameters(BARO_PRIMARY=2))
    np.testing.assert_allclose(lost["depth"].values, WATER, atol=1e-6)


def test_pulses_are_those_of_the_motors(tmp_path):
    """In the order of the motors; lights and camera are left out, with a note. Without the parameters all are read."""
    log = read(tmp_path, outputs(), parameters(**SERVOS))
    np.testing.assert_array_equal(log["pulses"].values, 1500 + np.round(400 * SHARES * DIRECTION))
    assert log["pulses"].origin == "RCOU C3, C4, C5, C6, C7, C8, C1, C2 (us)"
    assert "RCOU C9, C10, C11, C12, C13, C14 are no pulses of motors" in log.notes[0]
    assert read(tmp_path, outputs())["pulses"].values.shape == (30, 14)


def test_motors_of_a_frame_are_the_thrusters_of_a_vehicle(tmp_path):
    """Channels and directions of the file, and those of the geometry of the Heavy: each of its thrusters, by its own
    matrix, pushes as the motor of ArduPilot's table does."""
    signals = {"input": {"frame": "vectored_6dof", "unit": "us", "supply": 16, "dead_band": 0}}
    log = read(tmp_path, outputs(), parameters(**SERVOS), signals=signals)
    matrix = np.asarray(ut.vehicles.bluerov2_heavy().thruster_matrix())
    inputs = inputs_of(log, thruster_matrix=matrix)
    volts = 16 * np.round(400 * SHARES) / 400
    np.testing.assert_allclose(inputs.values, -volts, atol=1e-12)  # `undertow ardupilot` finds channels -1 to -8
    assert log["input"].origin == "RCOU C3, -C4, C5, C6, -C7, C8, C1, -C2 (us)"
    for suffix in (".mcap", ".csv"):  # a converted log still knows its motors
        log.save(tmp_path / f"dive{suffix}")
        again = inputs_of(read_log(tmp_path / f"dive{suffix}"), thruster_matrix=matrix)
        np.testing.assert_array_equal(again.values, inputs.values)
    with pytest.raises(BadInput, match=r"`frame` must have the thrusters of the vehicle.*negative where it turns"):
        inputs_of(log, thruster_matrix=matrix[:, :6])
    with pytest.raises(BadInput, match="`plant` must be a vehicle whose thrusters are the motors of vectored_6dof"):
        inputs_of(log)


def test_a_minus_turns_a_column(tmp_path):
    """A thruster, a range of them, pulses about neutral, and an axis of a vector."""
    entry = {"topic": "RCOU", "columns": ["-C1", "C2", "-C3..-C5"], "unit": "us", "supply": 16, "dead_band": 0}
    signals = {"input": entry, "pulses": {"topic": "RCOU", "columns": ["-C1", "-C14"]}}
    signals["depth"] = {"topic": "CTUN", "columns": "-Alt"}
    height = ("CTUN", "Qf", "TimeUS,Alt", "sm", [(t, -d) for t, d in zip(CLOCK.tolist(), WATER, strict=True)])
    log = read(tmp_path, outputs(), height, signals=signals)
    pulses = read(tmp_path, outputs(), signals={"pulses": {"topic": "RCOU", "columns": "C1..C14"}})["pulses"].values
    expected = (pulses[:, :5] - 1500) / 400 * 16 * [-1, 1, -1, -1, -1]
    np.testing.assert_allclose(log["input"].values, expected, atol=1e-12)
    assert log["input"].origin == "RCOU -C1, C2, -C3, -C4, -C5 (us)"
    np.testing.assert_array_equal(log["pulses"].values[:, 0], 3000 - pulses[:, 0])
    assert not log["pulses"].values[:, 1].any()  # no pulse at all stays none
    np.testing.assert_allclose(log["depth"].values, WATER, atol=1e-6)


def test_no_pulse_is_no_voltage(tmp_path):
    signals = {"input": {"topic": "RCOU", "columns": "C12..C14", "unit": "us", "supply": 16}}
    assert not read(tmp_path, outputs(), signals=signals)["input"].values.any()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"frame": "vectored_6dofs"}, "must be a frame of ArduSub, vectored_6dof or vectored, but is vectored_6dofs"),
        ({"frame": "vectored", "columns": "C1..C8"}, "must be those of the 6 motors of vectored, but is 8"),
        ({"frame": ["vectored"]}, "must be a frame of ArduSub"),
    ],
)
def test_frames_that_are_none(entry, message):
    with pytest.raises(BadInput, match=message):
        mapping_of({"signals": {"input": {**entry, "unit": "us", "supply": 16}}})
    with pytest.raises(BadInput, match=r"signals.depth.frame"):
        mapping_of({"signals": {"depth": {"frame": "vectored", "columns": "x"}}})


def test_a_file_without_the_motors_of_the_frame(tmp_path):
    few = {name: value for name, value in SERVOS.items() if name != "SERVO2_FUNCTION"}
    with pytest.raises(BadInput, match=r"dive.bin has no pulses of motor 8\. Give the columns of the motors 1 to 8"):
        read(tmp_path, outputs(), parameters(**few), signals={"input": {"frame": "vectored_6dof", "unit": "us", "supply": 16}})  # fmt: skip
