"""Checks of a log before an identification: each defect is found and named, and a sound log passes."""

import numpy as np
import pytest

from undertow.core.runtime import in_precision
from undertow.logs import frames
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.commanded_thrust import commanded_thrust
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.run import simulate_scenario
from undertow.studies.identification.log_check import check_dive
from undertow.studies.identification.simulated_dive import telegraph_dive

DURATION = 40.0  # s
NOISE = {"position": 0.01, "attitude": 0.005, "body_velocity": 0.01, "angular_velocity": 0.005}
PERIODS = np.array([3.1, 4.3, 5.7])  # s


def sound_log(seed=0):
    """A motion in closed form, with noise: angles and body velocities are sines."""
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, DURATION, 0.001)
    frequency = 2 * np.pi / PERIODS
    angles = np.array([0.5, 0.4, 1.5]) * np.sin(frequency * time[:, None])
    rates = np.array([0.5, 0.4, 1.5]) * frequency * np.cos(frequency * time[:, None])
    velocity = np.array([0.6, 0.5, 0.4]) * np.sin(1.3 * frequency * time[:, None] + 1.0)
    world = np.einsum("kij,kj->ki", frames.rotations(angles), velocity)
    position = np.array([0.0, 0.0, 5.0]) + 0.001 * np.cumsum(world, axis=0)
    truth = {
        "position": (position, ("north", "east", "down"), "m", 100),
        "attitude": (angles, ("roll", "pitch", "yaw"), "rad", 50),
        "body_velocity": (velocity, ("surge", "sway", "heave"), "m/s", 100),
        "angular_velocity": (frames.angular_velocity_of_rates(angles, rates), ("p", "q", "r"), "rad/s", 20),
    }
    signals = {
        name: Series(
            time[::every], rows[::every] + NOISE[name] * generator.normal(size=rows[::every].shape), names, unit
        )
        for name, (rows, names, unit, every) in truth.items()
    }
    signals["input"] = Series(time[::50], generator.uniform(-1, 1, (len(time[::50]), 8)), unit="V")
    return Log(signals, "sound", "CSV")


def changed(log, name, change):
    """The log with other values of one signal."""
    series = log[name]
    return Log({**log.signals, name: series._replace(values=change(series.values.copy()))}, log.source, log.format)


def later(log, name, delay):
    series = log[name]
    return Log({**log.signals, name: series._replace(time=series.time + delay)}, log.source, log.format)


def without(log, *names):
    return Log({name: series for name, series in log.signals.items() if name not in names}, log.source, log.format)


def check(log):
    with in_precision("float64"):
        return check_dive(log, log["input"])


def found(log, severity=None):
    """Concern and name of the findings."""
    return {(f.concern, f.name) for f in check(log).findings if severity in (None, f.severity)}


def with_outliers(values):
    generator = np.random.default_rng(1)
    hit = generator.random(len(values)) < 0.1
    values[hit] += generator.normal(size=(hit.sum(), values.shape[1]))
    return values


def with_column(number, value):
    def change(values):
        values[:, number] = value
        return values

    return change


def stuck(values):
    values[len(values) // 3 : len(values) // 2 + len(values) // 6] = values[len(values) // 3]
    return values


def test_a_sound_log_passes_and_a_sign_is_found():
    checked = check(sound_log())
    assert checked.findings == ()
    assert abs(checked.offsets["rates"].delay) < 0.01
    turned = changed(sound_log(), "angular_velocity", lambda values: values * [1, -1, 1])
    (finding,) = check(turned).findings
    assert (finding.name, finding.severity) == ("rates.q", "left_out")
    assert "other sign" in finding.sentence
    assert "minus" in str(finding)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(1, 21))
def test_no_false_findings(seed):
    assert check(sound_log(seed)).findings == ()


DEFECTS = {
    "degrees": (lambda log: changed(log, "attitude", np.degrees), "refused", ("log", "")),
    "degrees without rates": (
        lambda log: without(changed(log, "attitude", np.degrees), "angular_velocity"), "refused", ("log", ""),
    ),
    "degrees a second": (lambda log: changed(log, "angular_velocity", np.degrees), "left_out", ("sensor", "rates.p")),
    "z up": (lambda log: changed(log, "position", lambda v: v * [1, 1, -1]), "left_out", ("sensor", "position")),
    "east, north, up": (
        lambda log: changed(log, "position", lambda v: v[:, [1, 0, 2]] * [1, 1, -1]), "left_out", ("sensor", "position"),
    ),
    "u and v": (
        lambda log: changed(log, "body_velocity", lambda v: v[:, [1, 0, 2]]), "left_out", ("sensor", "velocity.u"),
    ),
    "sign of w": (
        lambda log: changed(log, "body_velocity", lambda v: v * [1, 1, -1]), "left_out", ("sensor", "velocity.w"),
    ),
    "slope": (lambda log: changed(log, "angular_velocity", lambda v: v * [1, 1, 0.7]), "note", ("sensor", "rates.r")),
    "heading": (lambda log: changed(log, "attitude", with_column(2, 0.0)), "left_out", ("sensor", "attitude.yaw")),
    "constant": (lambda log: changed(log, "body_velocity", with_column(1, 0.0)), "left_out", ("sensor", "velocity.sway")),
    "dead": (lambda log: changed(log, "angular_velocity", lambda v: 1e-156 * v), "left_out", ("sensor", "rates")),
    "stuck": (lambda log: changed(log, "body_velocity", stuck), "left_out", ("sensor", "velocity")),
    "outliers": (lambda log: changed(log, "body_velocity", with_outliers), "note", ("sensor", "velocity")),
    "late rates": (lambda log: later(log, "angular_velocity", 0.3), "left_out", ("sensor", "rates")),
    "late velocity": (lambda log: later(log, "body_velocity", 0.1), "note", ("sensor", "velocity")),
    "other clock": (lambda log: later(log, "input", 3600.0), "refused", ("log", "")),
    "no inputs": (lambda log: changed(log, "input", np.zeros_like), "refused", ("log", "")),
    "an idle input": (lambda log: changed(log, "input", with_column(4, 0.0)), "note", ("input", "5")),
    "no velocity": (lambda log: without(log, "body_velocity", "position"), "refused", ("axis", "surge")),
    "slow": (lambda log: changed(log, "body_velocity", lambda v: 0.2 * v), "refused", ("axis", "sway")),
}  # fmt: skip


@pytest.mark.full
@pytest.mark.parametrize("defect", DEFECTS)
def test_each_defect_is_named(defect):
    spoil, severity, name = DEFECTS[defect]
    assert name in found(spoil(sound_log()), severity)


@pytest.mark.full
def test_offsets_are_measured():
    checked = check(later(later(sound_log(), "angular_velocity", 0.3), "body_velocity", -0.15))
    assert checked.offsets["rates"].delay == pytest.approx(0.3, abs=0.01)
    assert checked.offsets["velocity"].delay == pytest.approx(-0.15, abs=0.03)


@pytest.mark.full
@pytest.mark.parametrize(
    "change",
    [
        lambda series: series._replace(values=np.full_like(series.values, np.nan)),
        lambda series: series._replace(values=np.ones_like(series.values)),
        lambda series: series._replace(time=series.time[:0], values=series.values[:0]),
        lambda series: series._replace(time=series.time[:3], values=series.values[:3]),
        lambda series: series._replace(time=series.time[:30], values=series.values[:30]),
        lambda series: series._replace(values=np.where(series.values > 0, series.values, np.nan)),
        lambda series: series._replace(values=1e300 * np.sign(series.values)),
    ],
)
def test_nothing_makes_the_checks_fail(change):
    """With every signal spoiled, and with each one alone."""
    log = sound_log()
    spoiled = {name: change(series) for name, series in log.signals.items()}
    assert any(f.severity == "refused" for f in check(Log(spoiled, "spoiled", "CSV")).findings)
    for name in log.signals:
        assert check(Log({**log.signals, name: spoiled[name]}, "spoiled", "CSV")).findings != ()
    for name in set(log.signals) - {"input"}:
        assert check(without(log, *(set(log.signals) - {"input", name}))).findings != ()


@pytest.mark.full
@pytest.mark.parametrize("lag", [0.01, 0.02])
def test_inputs_of_quick_thrusters_are_not_said_to_be_late(lag):
    """At steps of 0.05 s the integration would make 20 ms of lag 116 ms, and nothing of 10 ms."""
    with in_precision("float64"):
        plant = hybrid_vehicle(bluerov2_heavy(), commanded_thrust(time_constant=lag))
        log = telegraph_dive(plant, {}, 0, DURATION)
        checked = check_dive(log, log["input"], plant)
    assert checked.findings == ()
    assert checked.offsets["inputs"].delay == pytest.approx(0.0, abs=0.02)


@pytest.mark.full
def test_a_dive_of_a_vehicle_passes_and_a_late_input_is_noticed():
    with in_precision("float64"):
        plant = hybrid_vehicle(bluerov2_heavy(), t200("static"))
        log = telegraph_dive(plant, {"net_buoyancy": 3.0}, 5, DURATION)
        assert check_dive(log, log["input"], plant).findings == ()
        late = log["input"]._replace(time=log["input"].time + 0.3)
        checked = check_dive(log, late, plant)
        assert checked.offsets["inputs"].delay == pytest.approx(0.3, abs=0.03)
        assert [finding.concern for finding in checked.findings] == ["input"]
        with_gaps = log["input"].values.copy()
        with_gaps[::3] = np.nan
        checked = check_dive(log, log["input"]._replace(values=with_gaps), plant)
        assert [(finding.concern, finding.severity) for finding in checked.findings] == [("input", "note")]


@pytest.mark.full
def test_a_controller_that_answers_to_a_current_is_no_late_clock():
    """It pushes against an acceleration that it did not cause: inputs seemed to come 0.3 s late, and were moved."""
    wandering = {"kind": "gauss_markov_current", "mean": [0.1, 0.1, 0.0], "deviation": [0.1, 0.1, 0.05]}
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "controller": {"kind": "pid", "frequency": 1.5},
        "reference": {"kind": "lissajous", "amplitude": [1, 1, 0.5, 1], "frequency": [0.4, 0.5, 0.6, 0.4], "depth": 5},
        "disturbance": wandering | {"correlation_time": 4.0, "span": 100.0},
        "navigation": {"kind": "degraded", "position_noise": [0.01] * 6, "velocity_noise": [0.01] * 6},
        "initial": {"position": [0, 0, 5, 0, 0, 0]},
        "loop": {"duration": 60, "dt": 0.02, "record": 0.02},
    }
    run = simulate_scenario(scenario)
    log = run.log()
    checked = check_dive(log, log["input"], run.result.built.closed_loop.plant)
    assert "inputs" not in checked.offsets
    (finding,) = [finding for finding in checked.findings if finding.concern == "input"]
    assert finding.severity == "note" and "of the thrust that the file says" in finding.sentence
