"""What a replay shows: recomputed signals by closed forms, packing by a round trip, and the page that holds it."""

import base64
import json
import re
from importlib.resources import files

import numpy as np
import pytest
from test_page import parsed

import undertow as ut
from undertow.analysis.metrics import meanings
from undertow.control.navigation.perfect import perfect
from undertow.physics.thrusters.first_order import first_order
from undertow.report import run_page
from undertow.report.plotted import Plotted
from undertow.report.replay import replay_section, trials_again
from undertow.report.replay.recomputed import thrust_along, thrust_limits
from undertow.report.replay.replay_data import hull_size, packed, page_data, replay_of
from undertow.report.replay.trials_again import replays_of_trials
from undertow.report.run_page import RunPageContents, write_run_page
from undertow.scenario.build import build
from undertow.scenario.fault_injection import with_faults
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_facts import facts_from
from undertow.scenario.results.run_result import RunRecord, RunResult
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.schema import Fault
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

WATER = (0.3, -0.2, 0.1)  # m/s


@pytest.fixture(scope="module")
def loop():
    """BlueROV2 Heavy in a current, with its third thruster lost at 10 s."""
    plant = ut.HybridVehicle(
        ut.vehicles.bluerov2_heavy(), first_order(thrust_per_volt=2.0, time_constant=0.5, supply=16)
    )
    law, hold = ut.controllers.pid(plant.model(), frequency=1.0), ut.references.setpoint([0.0] * 6)
    healthy = ClosedLoop(plant, law, hold, ut.disturbances.current(WATER), perfect())
    lost = Fault(target="thruster 3", mode="fraction", severity=0.0, onset=10.0)
    return with_faults(healthy, [lost])[0]


@pytest.fixture
def run(make_run, loop):
    """A made-up run of 20 s whose input is 4 V; it fails at 15 s."""
    made = make_run(samples=2001, status="diverged", ended=15.0)
    metrics = {"position_rms": 1.234e-7, "energy": 5.0}
    known = {name: one._asdict() for name, one in meanings(loop).items() if name in metrics}
    made["input"].values[:] = 4.0
    made["power"] = ("time", "actuator"), np.full(made["input"].shape, 2.0)
    made["position"].values[made["time"].values > 15.0] = np.nan
    words = {"title": "a <run>", "status_sentence": "It diverged.", "seed": 0, "metric_meanings": json.dumps(known)}
    return made.assign_attrs(words, metrics=json.dumps({"steady": None, "whole": metrics}))


def unpacked(series):
    """As the script of the page does it."""
    whole = np.frombuffer(base64.b64decode(series["data"]), f"<u{series['bytes']}").reshape(-1, len(series["low"]))
    low, high = np.array(series["low"]), np.array(series["high"])
    return low + whole / (256 ** series["bytes"] - 1) * (high - low)


@pytest.mark.parametrize("size", [1, 2])
def test_packing_is_exact_to_half_a_level(size):
    values = np.random.default_rng(0).normal(size=(500, 3)) * [1e-6, 1.0, 1e6] + [0.0, 5.0, 0.0]
    values[:, 1] = 7.5  # a component that never changes
    level = (values.max(axis=0) - values.min(axis=0)) / (256**size - 1)
    error = np.abs(unpacked(packed(values, size)) - values).max(axis=0)
    assert (error <= 0.51 * level).all() and error[1] == 0
    assert (error[[0, 2]] > 0.4 * level[[0, 2]]).all()


def test_script_turns_north_east_down_into_the_axes_of_the_screen():
    script = files("undertow.report.replay").joinpath("scene.js").read_text()
    numbers = re.search(r"Matrix4\(\)\.set\(([^)]*)\)", script)
    turn = np.array([float(one) for one in numbers[1].split(",")]).reshape(4, 4)[:3, :3]
    north, east, down = turn.T
    assert north.tolist() == [0, 0, -1] and east.tolist() == [1, 0, 0] and down.tolist() == [0, -1, 0]
    assert np.linalg.det(turn) == 1.0


def test_thrust_follows_the_thruster_with_its_lag():
    inputs = np.tile([[3.0, -1.0]], (301, 1))
    inputs[0] = 0.0
    thrust = thrust_along(first_order(thrust_per_volt=2.0, time_constant=0.5), inputs, 0.02)
    settled = 2.0 * (1 - np.exp(-(0.02 * np.arange(301)[:, None] - 0.01) / 0.5)) * [3.0, -1.0]
    assert np.abs(thrust[1:] - settled[1:]).max() < 0.02 * 6 and np.abs(thrust[0]).max() == 0
    assert thrust[-1] == pytest.approx([6.0, -2.0], rel=1e-4)


def test_thrust_without_a_state_is_that_of_the_input():
    inputs = np.linspace(-5, 5, 12).reshape(6, 2)
    static = ut.thrusters.linear_voltage()
    assert thrust_along(static, inputs, 0.05) == pytest.approx(np.asarray(static.thrust((), inputs)))


def test_limits_of_thrust():
    limited = first_order(thrust_per_volt=2.0, supply=16.0, reverse_share=0.8)
    assert thrust_limits(limited, 2) == pytest.approx(np.array([[-25.6, 32.0]] * 2), rel=1e-3)
    assert np.isinf(thrust_limits(first_order(), 2)).all()


def test_replay_of_a_run(run, loop):
    replay = replay_of(run, loop, 0, None)
    assert replay.time[[0, -1]] == pytest.approx([0.0, 15.0]) and np.diff(replay.time) == pytest.approx(0.05)
    assert all(len(values) == len(replay.time) and np.isfinite(values).all() for values in replay.series.values())
    assert replay.series["position"] == pytest.approx(run["position"].values[:1501:5, :3])
    assert replay.series["water"] == pytest.approx(np.tile(WATER, (301, 1)))
    assert replay.series["energy"][:, 0] == pytest.approx(16.0 * replay.time)  # eight thrusters of 2 W
    off = run["error"].values[200, 3:]
    assert replay.series["error"][40, 1] == pytest.approx(np.degrees(np.linalg.norm(off)))
    thrust = replay.series["thrust"]
    assert thrust[-1] == pytest.approx([8.0, 8.0, 0.0] + [8.0] * 5, rel=1e-3)
    assert thrust[199, 2] == pytest.approx(8.0, rel=1e-3)
    assert replay.limited and replay.thrusters.limits == pytest.approx(np.array([[-32.0, 32.0]] * 8), rel=1e-3)
    assert replay.series["attitude"] == pytest.approx(quaternions(run["position"].values[:1501:5, 3:]))


def quaternions(angles):
    """Products of the turns about down, starboard and forward, written out."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles.T / 2), np.sin(angles.T / 2)
    scalar, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    found = np.stack([scalar, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy], axis=-1)
    for i in range(1, len(found)):
        found[i] *= np.sign(found[i] @ found[i - 1])
    return found


def test_plant_that_is_no_vehicle_has_no_replay(run):
    plant = ut.plants.inverted_pendulum()
    pendulum = ClosedLoop(
        plant, ut.rcaf(plant.model(), preset="paper"), ut.references.sine(), ut.disturbances.none(), perfect()
    )
    assert replay_of(run, pendulum, 0, None) is None


def test_size_is_that_of_the_file_or_follows_from_mass_and_inertia(run):
    odin = ut.vehicles.odin()
    low = np.sqrt(6 * (8.0 - 2 * 125 * 0.05**2) / 125)  # 8 kg m^2 about an origin 5 cm above the centre of gravity
    assert hull_size(odin, None) == pytest.approx([np.sqrt(6 * 8.0 / 125)] * 2 + [low])  # its sphere is 0.62 m wide
    scenario = "plant: {vehicle: {kind: my_rov.yaml, contents: {size: [1.0, 0.5, 0.4]}}}"
    known = facts_from(run.attrs | {"scenario": scenario}).hull
    assert hull_size(odin, known).tolist() == [1.0, 0.5, 0.4]


def test_several_runs_have_labels_and_colours_of_their_own(two_minutes):
    runs = json.loads(page_data([two_minutes, two_minutes._replace(label="</script>")]))["runs"]
    assert [one["label"] for one in runs] == ["one", "</script>"] and runs[0]["colour"] != runs[1]["colour"]
    assert "<" not in page_data([two_minutes._replace(label="</script>")])


_PICTURE = 100_000  # bytes of a figure with many panels


def test_page_of_two_minutes_is_small_and_loads_nothing(run, two_minutes, tmp_path):
    pictures = {f"figure{number}": b"x" * _PICTURE for number in range(6)}
    write_run_page(
        tmp_path / "run.html", RunRecord(run, facts_from(run.attrs)), RunPageContents(pictures, two_minutes, [])
    )
    page = (tmp_path / "run.html").read_text()
    assert len(page) < 2_000_000
    words = [re.sub(r"<script.*?</script>", "", page, flags=re.S)]
    for name, attributes in parsed(words[0]).elements:
        assert name not in ("link", "iframe", "script")
        assert all(attributes.get(key, "#").startswith(("#", "data:")) for key in ("src", "href"))
    assert not re.search(r"""(src|href)\s*=\s*["']?https?:|url\(|@import""", words[0])
    assert not re.search(r"<script[^>]*src", page)
    assert "Three.js Authors" in page and "SPDX-License-Identifier: MIT" in page
    assert "It did not go well: diverged after 15 s. It diverged." in page and "<h1>a &lt;run&gt;</h1>" in page
    assert "1.234&thinsp;&times;&thinsp;10<sup>\u22127</sup>" in page


def test_page_without_three_js_says_what_to_install(run, two_minutes, tmp_path, monkeypatch):
    monkeypatch.setattr(replay_section, "_THREE_JS", ("no_such_package", "three.min.js"))
    write_run_page(tmp_path / "run.html", RunRecord(run, facts_from(run.attrs)), RunPageContents({}, two_minutes, []))
    page = (tmp_path / "run.html").read_text()
    assert "pip install jupyter-threejs-sage==130" in page and "<script" not in page


@pytest.fixture(scope="module")
def trials():
    """Two trials of one structure, and one of another, which diverges."""
    scenario = {
        "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "ideal"}},
        "controller": {"kind": "pid", "frequency": 1.0},
        "reference": {"kind": "setpoint", "position": [1.0, 2.0, 1.0, 0.0, 0.0, 0.5]},
        "disturbance": {"kind": "gauss_markov_current", "deviation": [0.1, 0.1, 0.1]},
        "loop": {"dt": 0.02, "duration": 2.0, "record": 0.1},
    }
    wild = scenario | {"controller": {"kind": "adrc", "bandwidth": 500.0}}
    given = {"one": scenario, "wild": wild, "two": scenario | {"seed": 7}}
    return {label: build(from_data(each)) for label, each in given.items()}


@pytest.mark.slow
def test_trials_are_run_again_as_they_were(trials):
    replays, failures = replays_of_trials(trials)
    assert failures == [] and [replay.label for replay in replays] == list(trials)
    assert [replay.status for replay in replays] == ["completed", "diverged", "completed"]
    for replay, built in zip(replays, trials.values(), strict=True):
        single = replay_of(run_scenario(built).series, built.closed_loop, built.scenario.seed, None)
        assert single is not None and (replay.time == single.time).all()
        for name, values in single.series.items():
            assert replay.series[name] == pytest.approx(values, rel=1e-9, abs=1e-9), name


def test_failed_trials_leave_the_others(trials, monkeypatch):
    shown = lambda several, signals, every: {"one": "a replay"} if "one" in several else 1 / 0
    monkeypatch.setattr(trials_again, "_together", shown)
    replays, (failure,) = replays_of_trials(trials)
    assert replays == ["a replay"] and failure.startswith("the replay of wild could not be made (")


def test_failed_replay_is_a_sentence(run, loop, monkeypatch):
    monkeypatch.setattr(run_page, "replay_of", lambda *_: 1 / 0)
    shown = run_page.page_contents(RunResult(run, facts_from(run.attrs), loop, None), lambda: Plotted({}, {}, []))
    assert shown.replay is None and "the replay could not be made" in shown.failures[0]
