"""A run, its MCAP and its CSV hold the same bits; replayed it is the same run; its own model predicts it."""

import json

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

import undertow as ut
from undertow.core.errors import BadInput
from undertow.logs.foxglove_layout import layout
from undertow.logs.log import Log
from undertow.outside.log_score import AXES, score
from undertow.scenario.build import build

pytestmark = pytest.mark.full

HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0.1, 0.5], "settling": 2},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "loop": {"duration": 4.0, "dt": 0.01, "record": 0.01},
}

# Where the vehicle does not matter.
AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [0]},
    "loop": {"duration": 4.0, "dt": 0.01, "record": 0.01},
}

# A self-prediction is as near as rotors forget within the two seconds of the run-in.
FORGOTTEN = 1e-6


@pytest.fixture(scope="module")
def run():
    return ut.simulate_scenario(HEAVY)


@pytest.fixture(scope="module")
def files(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for name in ("run.mcap", "run.csv"):
        run.log().save(folder / name)
    run.save(folder / "run.nc")
    return folder


@pytest.mark.parametrize("name", ["run.mcap", "run.csv", "run.nc"])
def test_files_hold_the_bits_of_the_run(run, files, name):
    log = ut.read_log(files / name)
    series = [key for key, one in run.dataset.data_vars.items() if one.dims[0] == "time"]
    assert list(log.signals) == series if name != "run.mcap" else set(log.signals) == set(series)
    for key in series:
        values = run.dataset[key].values
        assert log[key].time.tobytes() == run.dataset["time"].values.tobytes(), key
        np.testing.assert_array_equal(log[key].flat(), values.reshape(len(values), -1), err_msg=key)
        assert log[key].unit == run.dataset[key].attrs["units"]
    assert log["position"].columns == ("north", "east", "down", "roll", "pitch", "yaw")
    assert log["input"].columns == tuple(f"T{i}" for i in range(1, 9))


def test_a_replayed_run_is_the_run(run, files):
    """Bit for bit, from either file; and the copy of the log that the results keep repeats it without the file."""
    for name in ("run.mcap", "run.csv"):
        again = ut.simulate_scenario(HEAVY | {"controller": {"kind": "replay", "file": str(files / name)}})
        for key in ("position", "velocity", "input", "commanded_input"):
            np.testing.assert_array_equal(again.dataset[key].values, run.dataset[key].values, err_msg=f"{name} {key}")
    again.save(files / "again.nc")
    third = ut.simulate_scenario(files / "again.nc")
    np.testing.assert_array_equal(third.dataset["position"].values, run.dataset["position"].values)


def test_linear_and_held(files):
    """Between samples of 0 and 8 V a quarter of the way: 0 V held, 2 V linear; constant outside; the start is the log's."""
    rows = np.column_stack([[5.0, 5.4, 5.8], np.outer([0.0, 8.0, 4.0], np.ones(8))])
    header = "time [s]," + ",".join(f"input.T{i} [V]" for i in range(1, 9))
    (files / "steps.csv").write_text("\n".join([header, *(",".join(map(repr, row)) for row in rows.tolist())]))
    expected = {"hold": [0, 0, 0, 0, 8, 8, 8, 8, 4, 4, 4], "linear": [0, 2, 4, 6, 8, 7, 6, 5, 4, 4, 4]}
    for interpolation, volts in expected.items():
        controller = {"kind": "replay", "file": "steps.csv", "interpolation": interpolation}
        loop = {"duration": 1.0, "dt": 0.1, "record": 0.1}
        (files / "steps.yaml").write_text(json.dumps(HEAVY | {"controller": controller, "loop": loop}))
        found = ut.simulate_scenario(files / "steps.yaml").dataset["commanded_input"].values
        np.testing.assert_allclose(found, np.outer(volts, np.ones(8)), atol=1e-12)


def test_a_long_log_is_replayed_by_the_other_backend(run, tmp_path):
    """A table of more than 4000 numbers; the motion agrees to rounding."""
    log = run.log()
    several = np.vstack([log["commanded_input"].values] * 2)
    time_ = np.arange(len(several)) * 0.01
    whole = Log({"input": log["commanded_input"]._replace(time=time_, values=several)}, "x", "CSV")
    whole.save(tmp_path / "long.mcap")
    again = ut.simulate_scenario(HEAVY | {"controller": {"kind": "replay", "file": str(tmp_path / "long.mcap")}})
    assert again.dataset.attrs["left_to_xla"] == f"a table of {9 * len(several)} numbers, more than 4000"
    np.testing.assert_allclose(again.dataset["position"].values, run.dataset["position"].values, atol=1e-9)


def test_its_own_model_predicts_a_run_and_another_does_not(run):
    log = run.log()
    own = score(build(HEAVY), log, horizons=(0.5, 1.5), every=0.25)
    assert len(own.starts) == 3 and own.rms.shape == (2, len(AXES))
    assert own.rms.max() < FORGOTTEN
    plant = HEAVY["plant"] | {"vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}}
    other = score(build(HEAVY | {"plant": plant}), log, horizons=(0.5, 1.5), every=0.25)
    assert (other.rms[:, [0, 1, 6, 7]] > 1e-2).all()


def test_a_score_of_a_log_in_other_signals(run):
    """Position, attitude, body velocity and angular velocity at other times, as in logs of others: the same score."""
    log = run.log()
    truth = log["position"].values
    velocity, rates = log["velocity"].values[:, :3], log["velocity"].values[:, 3:]
    turned = Rotation.from_euler("ZYX", truth[:, 5:2:-1])
    roll, pitch = truth[:, 3], truth[:, 4]
    zero, one = np.zeros_like(roll), np.ones_like(roll)
    to_body = np.array(
        [
            [one, zero, -np.sin(pitch)],
            [zero, np.cos(roll), np.cos(pitch) * np.sin(roll)],
            [zero, -np.sin(roll), np.cos(pitch) * np.cos(roll)],
        ]
    )
    turning = np.einsum("ijk,kj->ki", to_body, rates)
    part = lambda values, *names: log["position"]._replace(values=values, columns=names)
    wrapped = (truth[:, 3:] + np.pi) % (2 * np.pi) - np.pi
    signals = {
        "position": part(truth[:, :3], "north", "east", "down"),
        "attitude": part(wrapped, "roll", "pitch", "yaw"),
        "body_velocity": part(turned.inv().apply(velocity), "surge", "sway", "heave"),
        "angular_velocity": part(turning, "p", "q", "r"),
        "input": log["input"],
    }
    found = score(build(HEAVY), Log(signals, "other.bin", "ArduPilot"), horizons=(0.5, 1.5), every=0.25)
    assert found.rms.max() < FORGOTTEN


def test_logs_that_cannot_be_scored(run):
    log, built = run.log(), build(HEAVY)
    short = {name: one._replace(time=one.time[:100], values=one.values[:100]) for name, one in log.signals.items()}
    cases = [
        (Log(short, "a.csv", "CSV"), "together for 12 s or longer, but is a.csv, which has both for 0.99 s"),
        (Log({k: v for k, v in log.signals.items() if "input" not in k}, "a.csv", "CSV"), "have the signal `input` or"),
        (Log({k: v for k, v in log.signals.items() if "velocity" not in k}, "a.csv", "CSV"), "have the signal `velocity`"),
        (Log(dict(log.signals) | {"input": log["input"]._replace(values=log["input"].values[:, :6])}, "a.csv", "CSV"), "have 8 inputs"),
    ]  # fmt: skip
    for wrong, said in cases:
        with pytest.raises(BadInput, match=said):
            score(built, wrong)
    with pytest.raises(BadInput, match="be a vehicle with thrusters"):
        score(
            build({"plant": "inverted_pendulum", "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1}}), log
        )


@pytest.mark.parametrize(
    "change, said",
    [
        ({"file": "missing.mcap"}, r"`controller.file` must be an existing file"),
        ({"file": "six.csv"}, r"`controller.commands` must have 8 inputs, as many as the vehicle has thrusters, but is those of 6"),
        ({"file": "pulses.csv"}, r"`controller.file` must have the signal `commanded_input` or `input`.*: `signals: {input: {columns: \[pwm1, pwm2, ...\], unit: us, supply: 16}}`"),
        ({"file": "own.csv"}, r"`controller.mapping` must be given, but is own.csv"),
        ({"file": "own.csv", "mapping": {"time": "t", "signals": {"input": {"columns": "z"}}}}, r"`controller.mapping.signals.input.columns` must be in own.csv, but is z"),
        ({"file": "own.csv", "mapping": "m.yaml"}, r"`controller.mapping.signals.input.unit` must be one of V, mV, N, us, 1, % for `input`, but is rad \(m.yaml, line 2\)"),
        ({"file": "own.csv", "mapping": "none.yaml"}, r"`controller.mapping` must be an existing file"),
        ({}, r"`controller.commands` must be given"),
        ({"commands": [[0, 1], [1, 1]], "interpolation": "cubic"}, r"`controller.interpolation` must be one of hold, linear"),
    ],
)  # fmt: skip
def test_replays_that_cannot_be_made(tmp_path, change, said):
    rows = "\n".join(f"{t}," + ",".join("1" * 6) for t in (0.0, 1.0))
    for name, signal_, unit in (("six", "input", "V"), ("pulses", "pulses", "us")):
        header = "time [s]," + ",".join(f"{signal_}.T{i} [{unit}]" for i in range(1, 7))
        (tmp_path / f"{name}.csv").write_text(f"{header}\n{rows}\n")
    (tmp_path / "own.csv").write_text("t,x\n0,1\n1,2\n")
    (tmp_path / "m.yaml").write_text("signals:\n  input: {columns: [x], unit: rad}\n")
    (tmp_path / "s.yaml").write_text(json.dumps(HEAVY | {"controller": {"kind": "replay"} | change}))
    with pytest.raises(BadInput, match=said):
        ut.simulate_scenario(tmp_path / "s.yaml")


def test_foxglove_finds_what_it_needs(run, files):
    """Read by the package of MCAP's authors: every message fits its schema, and the view shows the motion."""
    kinds, places, topics, stamps = {}, [], {}, []
    with (files / "run.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None and (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            content = json.loads(message.data)
            if schema.name not in kinds:
                kinds[schema.name] = jsonschema.Draft7Validator(json.loads(schema.data))
            if channel.topic not in topics or message.sequence % 50 == 0:
                kinds[schema.name].validate(content)
            topics.setdefault(channel.topic, content)
            stamps.append(message.log_time)
            if schema.name == "foxglove.FrameTransforms":
                places += [(message.log_time, one) for one in content["transforms"]]
    assert set(topics) == {"/motion", "/thrusters", "/controller", "/tf", "/scene"}
    assert stamps == sorted(stamps)
    up, *moving = places
    assert (up[1]["parent_frame_id"], up[1]["child_frame_id"]) == ("world", "ned")
    axes = Rotation.from_quat([up[1]["rotation"][axis] for axis in "xyzw"])
    np.testing.assert_allclose(axes.apply(np.eye(3)), [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-15)  # east, north, up
    motion = [(stamp, one) for stamp, one in moving if one["child_frame_id"] == "vehicle"]
    outputs = run.dataset["position"].values
    np.testing.assert_array_equal([[one["translation"][axis] for axis in "xyz"] for _, one in motion], outputs[:, :3])
    turned = Rotation.from_quat([[one["rotation"][axis] for axis in "xyzw"] for _, one in motion])
    np.testing.assert_allclose(turned.as_euler("ZYX")[:, ::-1], outputs[:, 3:], atol=1e-12)
    np.testing.assert_allclose(np.array([stamp for stamp, _ in motion]) * 1e-9, run.dataset["time"].values, atol=1e-9)
    for panel in json.loads(layout())["configById"].values():
        for path in panel.get("paths", ()):
            topic, signal_, column = path["value"].split(".")
            if signal_ != "estimate":  # which not every law has
                assert column in topics[topic][signal_], path


def test_an_autopilot_logs_its_steps(tmp_path):
    """The bits of the simulation; after another start the time goes on; nothing is written after `close_log`."""
    noisy = HEAVY | {"navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01}}
    noisy["reference"] = HEAVY["reference"] | {"start": [0] * 6}  # not at the noisy position that is measured there
    run = ut.simulate_scenario(noisy | {"loop": HEAVY["loop"] | {"duration": 1.0}})
    autopilot = ut.Autopilot(noisy, velocity="rates", log=tmp_path / "a.mcap")
    names = ("measured_position", "measured_velocity", "input")
    positions, velocities, applied = (run.dataset[name].values for name in names)
    autopilot.start(positions[0, :3], velocities[0], positions[0, 3:])
    for k in range(1, 100):
        autopilot.step(positions[k, :3], velocities[k], positions[k, 3:], applied=applied[k - 1])
    autopilot.start(positions[0, :3], velocities[0], positions[0, 3:])
    autopilot.close_log()
    autopilot.step(positions[0, :3], velocities[0], positions[0, 3:])
    log = ut.read_log(tmp_path / "a.mcap")
    assert len(log["commanded_input"].time) == 101 and not log.notes
    for name in ("measured_position", "measured_velocity", "commanded_input", "reference"):
        np.testing.assert_array_equal(log[name].values[:100], run.dataset[name].values[:100], err_msg=name)
        assert log[name].unit == run.dataset[name].attrs["units"]
    assert log["reference"].time[-1] == pytest.approx(1.0)
    with pytest.raises(BadInput, match=r"`log` must be a file whose name ends in .mcap"):
        ut.Autopilot(HEAVY, log=tmp_path / "a.csv")
    with pytest.raises(BadInput, match=r"`log` must be a file that can be written"):
        ut.Autopilot(HEAVY, log=tmp_path / "none" / "a.mcap")


def test_a_full_disk_does_not_stop_a_controller(tmp_path):
    (tmp_path / "full.mcap").symlink_to("/dev/full")
    autopilot = ut.Autopilot(AXIS, log=tmp_path / "full.mcap")
    silent, at = ut.Autopilot(AXIS), (np.zeros(1), np.zeros(1))
    silent.start(*at)
    with pytest.warns(UserWarning, match=r"full.mcap: No space left on device; later steps are not recorded"):
        autopilot.start(*at)
        found = [autopilot.step(*at) for _ in range(200)]
        autopilot.close_log()
    np.testing.assert_array_equal(found, [silent.step(*at) for _ in range(200)])


def test_a_navigation_filter_logs_its_steps(tmp_path):
    navigation = ut.NavigationFilter(HEAVY | {"navigation": {"kind": "observer"}}, log=tmp_path / "n.mcap")
    motion = navigation.start([1.0, 2.0, 3.0], np.zeros(6), [0.0, 0.0, 0.5])
    found = [motion] + [navigation.step({"depth": [3.0 + 0.01 * k]}) for k in range(30)]
    navigation.close_log()
    log = ut.read_log(tmp_path / "n.mcap")
    np.testing.assert_array_equal(log["position"].values, [one.position for one in found])
    np.testing.assert_array_equal(log["body_velocity"].values, [one.velocity[:3] for one in found])
    np.testing.assert_allclose(log["attitude"].values[0], [0, 0, 0.5], atol=1e-15)


def test_horizons_off_the_steps_of_the_curve(run):
    """Between steps of the curve, 0.1 s apart, linear; none below the first."""
    log = run.log()
    plant = HEAVY["plant"] | {"vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}}
    built = build(HEAVY | {"plant": plant})
    found = score(built, log, horizons=(0.1, 0.25, 1.5), every=0.25)
    np.testing.assert_allclose(found.rms[0], found.growth[0], rtol=1e-12)
    np.testing.assert_allclose(found.rms[1], (found.growth[1] + found.growth[2]) / 2, rtol=1e-9)
    np.testing.assert_allclose(found.rms[2], found.growth[14], rtol=1e-12)
    with pytest.raises(BadInput, match=r"`horizons` must be 0.1 s or longer, the step of the curve, but is 0.04 s"):
        score(built, log, horizons=(0.04, 1.0))


def test_a_model_that_diverges_is_no_score(run):
    log = run.log()
    pulses = log["input"]._replace(values=1500.0 + log["input"].values * 1e9)
    wrong = Log(dict(log.signals) | {"input": pulses}, "pwm.csv", "CSV")
    with pytest.raises(BadInput, match=r"pwm.csv, with which it diverges within [\d.]+ s of a start. Check the units"):
        score(build(HEAVY), wrong, horizons=(1.5,), every=0.25)
