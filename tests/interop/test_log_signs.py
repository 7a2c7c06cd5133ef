"""Logs of ArduSub whose thrusters are mapped the wrong way: a sentence names them, and mapped rightly none is said."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import undertow as ut
from undertow.logs.log import Log
from undertow.outside.log_score import score
from undertow.outside.log_signs import _best_set
from undertow.scenario.build import build
from undertow.scenario.log_file import read_log

sys.path.append(str(Path(__file__).parents[1] / "logs"))
from other_programs import ardupilot_bin

HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0.1, 0.5], "settling": 2},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "loop": {"duration": 10.0, "dt": 0.02, "record": 0.02},
}
DIRECTION = np.array([1, -1, 1, 1, -1, 1, 1, -1])  # of the motors, as the file has them
PULSES = {"unit": "us", "supply": 16, "dead_band": 0}


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    """A run as ArduSub would have logged it: EKF, attitude and gyro with noise, pulses in whole microseconds."""
    log, chance = ut.simulate_scenario(HEAVY).log(), np.random.default_rng(0)
    position, rates = log["position"].values, log["velocity"].values
    turned = Rotation.from_euler("ZYX", position[:, 5:2:-1])
    roll, pitch = position[:, 3], position[:, 4]
    p = rates[:, 3] - np.sin(pitch) * rates[:, 5]
    q = np.cos(roll) * rates[:, 4] + np.cos(pitch) * np.sin(roll) * rates[:, 5]
    r = np.cos(pitch) * np.cos(roll) * rates[:, 5] - np.sin(roll) * rates[:, 4]
    gyro = np.column_stack([p, q, r]) + chance.normal(scale=0.005, size=(len(p), 3))
    velocity = rates[:, :3] + chance.normal(scale=0.02, size=(len(p), 3))
    # Motor n is thruster n of the Heavy, which pushes the other way (`undertow ardupilot` finds channels -1 to -8).
    pulses = 1500 + np.round(-400 * log["input"].values / 16 * DIRECTION).astype(int)
    angles = np.degrees(turned.as_euler("ZYX")[:, ::-1])
    clock = np.round(log["position"].time * 1e6).astype(int).tolist()
    rows = lambda *parts: [(t, *row) for t, row in zip(clock, np.hstack(parts).tolist(), strict=True)]
    settings = {f"MOT_{i + 1}_DIRECTION": sign for i, sign in enumerate(DIRECTION.tolist())}
    settings |= {f"SERVO{i}_FUNCTION": 32 + i for i in range(1, 9)}
    tables = [
        ("PARM", "QNf", "TimeUS,Name,Value", "s--", [(0, name.encode(), float(value)) for name, value in settings.items()]),
        ("XKF1", "Qdddfff", "TimeUS,PN,PE,PD,VN,VE,VD", "smmmnnn", rows(position[:, :3], velocity)),
        ("ATT", "Qddd", "TimeUS,Roll,Pitch,Yaw", "sddd", rows(angles)),
        ("IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ", "sEEE", rows(gyro)),
        ("RCOU", "Q" + "H" * 8, "TimeUS," + ",".join(f"C{i}" for i in range(1, 9)), "s" + "Y" * 8, [(t, *row) for t, row in zip(clock, pulses.tolist(), strict=True)]),
    ]  # fmt: skip
    path = tmp_path_factory.mktemp("dive") / "dive.bin"
    path.write_bytes(ardupilot_bin(tables))
    return path, log


@pytest.fixture(scope="module")
def built():
    return build(HEAVY)


def scored(path, built, entry):
    log = read_log(path, {"signals": {"input": PULSES | entry}})
    return score(built, log, horizons=(1.0, 3.0), every=1.0)


@pytest.mark.full
def test_a_log_of_ardusub(dive, built):
    """With the frame the model follows the log, and nothing is said; with the channels in order, or one of them turned
    too many, the sentence names the thrusters and by how much the error would fall."""
    path, _ = dive
    right = scored(path, built, {"frame": "vectored_6dof"})
    assert right.rms[0, :3].max() < 0.03 and not right.warnings
    wrong = scored(path, built, {"topic": "RCOU", "columns": "C1..C8"})
    turned = np.flatnonzero(DIRECTION > 0) + 1
    names = ", ".join(f"T{number}" for number in turned)
    assert wrong.rms[0, :3].max() > 0.1
    assert f"With the input of {names} turned, the error of the velocities after half a second is" in wrong.warnings[0]
    assert wrong.summary()["warnings"] == list(wrong.warnings)
    columns = [f"{'-' if sign > 0 else ''}C{i + 1}" for i, sign in enumerate(DIRECTION)]
    same = scored(path, built, {"topic": "RCOU", "columns": columns})
    np.testing.assert_array_equal(same.rms, right.rms)


@pytest.mark.full
@pytest.mark.parametrize("turned", [range(8), [2], [0, 1, 5]])
def test_any_set_of_turned_thrusters_is_found(dive, built, turned):
    _, log = dive
    signs = np.where(np.isin(range(8), list(turned)), -1.0, 1.0)
    signals = dict(log.signals) | {"input": log["input"]._replace(values=signs * log["input"].values)}
    result = score(built, Log(signals, "dive.mcap", "undertow"), horizons=(1.0,), every=1.0)
    names = "all thrusters" if len(turned) == 8 else ", ".join(f"T{i + 1}" for i in turned)
    assert f"With the input of {names} turned" in result.warnings[0]


@pytest.mark.full
def test_inputs_of_something_else(dive, built):
    """Twice the voltage is worse than none; right inputs of the model's own vehicle are not."""
    _, log = dive
    assert not score(built, log, horizons=(1.0,), every=1.0).warnings
    signals = dict(log.signals) | {"input": log["input"]._replace(values=2.5 * log["input"].values)}
    result = score(built, Log(signals, "dive.mcap", "undertow"), horizons=(1.0,), every=1.0)
    assert "farther from its velocities after half a second than without any" in result.warnings[0]


@pytest.mark.full
def test_replay_of_motors(dive, tmp_path):
    """The run that the pulses of the log give is the run that they were made of, within the rounding of pulses."""
    path, log = dive
    mapping = {"signals": {"input": PULSES | {"frame": "vectored_6dof"}}}
    controller = {"kind": "replay", "file": str(path), "mapping": mapping}
    again = ut.simulate_scenario(HEAVY | {"controller": controller, "loop": HEAVY["loop"] | {"duration": 2.0}})
    inputs = again.dataset["commanded_input"].values
    np.testing.assert_allclose(inputs[:-1], log["input"].values[: len(inputs) - 1], atol=16 / 400)
    assert abs(again.dataset["position"].values - log["position"].values[: len(inputs)]).max() < 0.02


def test_the_fewest_thrusters_of_about_the_same_error():
    """Thruster 3 does nothing: it is not turned; of a thruster that explains the error, it is."""
    changes = np.array([[2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [1e-3, 1e-3, 0.0]])
    np.testing.assert_array_equal(_best_set(np.array([-2.0, 0.1, 0.3]), changes), [True, False, False])
    np.testing.assert_array_equal(_best_set(np.array([-2.0, 2.0, 0.3]), changes), [True, True, False])
    np.testing.assert_array_equal(_best_set(np.array([0.0, 0.0, 0.3]), changes), [False, False, False])
