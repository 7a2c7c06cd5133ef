"""Correlated errors of sensors: their statistics, a filter that is told of them or not, and what it says of itself."""

import jax
import numpy as np
import pytest

import undertow as ut
from undertow.control.navigation.consistency import innovation_monitor, normalised_square
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.sensors import compass, dvl, imu
from undertow.physics.sensors.gauss_markov import CorrelatedErrors, Disturbed
from undertow.physics.sensors.motion import motion_of
from undertow.physics.thrusters.thruster import PropellerReport


@jax.jit
def sampled(sampling, steps, step, key):
    """Readings of a truth of zero at every step."""
    zero = np.zeros(3)
    chance = lambda k: jax.random.normal(jax.random.fold_in(key, k), (3,))

    def advance(state, k):
        disturbed = Disturbed(np.eye(3), chance(k))
        delivery, state = sampling.deliver(state, k.astype(float) * step, zero, np.zeros(4), disturbed)
        return state, delivery.reading

    return jax.lax.scan(advance, sampling.init(zero, zero, chance(len(steps))), steps)[1]


@pytest.mark.full
@pytest.mark.parametrize("every", [1, 4], ids=["every sample", "one sample of four"])
def test_a_correlated_error_has_the_stated_deviation_and_time(every):
    """Autocorrelation exp(-t / tau), whether the loop sees all samples or passes over some."""
    period, deviation, tau, steps = 0.1, 0.02, 2.0, 40_000
    quiet = {"noise": 0.0, "resolution": 0.0, "delay": 0.0}
    sampling = dvl(period, **quiet, correlated_noise=deviation, correlation_time=tau).sampling
    step = every * period
    readings = np.asarray(sampled(sampling, np.arange(steps), step, jax.random.PRNGKey(1)))
    independent = 3 * steps * step / (2 * tau)
    assert abs(readings.std() / deviation - 1) < 4 / np.sqrt(2 * independent)
    for lag in (1, 5, 20):
        correlation = (readings[lag:] * readings[:-lag]).mean() / (readings**2).mean()
        assert abs(correlation - np.exp(-lag * step / tau)) < 4 / np.sqrt(independent)


def test_constants_stay_and_what_is_forgotten_is_gained():
    errors = CorrelatedErrors([0.3, 0.2], [2.0, np.inf])
    np.testing.assert_allclose(errors.kept(1.0), [np.exp(-0.5), 1.0])
    np.testing.assert_allclose(errors.gained(1.0), [0.09 * (1 - np.exp(-1.0)), 0.0])
    np.testing.assert_allclose(errors.after(np.ones(2), 1.0, np.zeros(2)), [np.exp(-0.5), 1.0])


def motion(yaw, speeds=None):
    report = None if speeds is None else PropellerReport(np.asarray(speeds, dtype=float), None)
    y = measurement_of_outputs(np.array([0, 0, 0, 0, 0, yaw]), np.zeros(6), report)
    return motion_of(y, np.zeros(3), np.zeros(()))


@pytest.mark.full
def test_the_deviation_of_a_compass_is_a_series_in_its_heading():
    yaw, speeds = 0.7, [100.0, -200.0]
    options = {"correlated_noise": 0.01, "correlation_time": 5, "hard_iron": 0.02, "soft_iron": 0.05}
    sensor = compass(**options, interference=1e-3, assumed_current=7.0, current_variation=3.0, current_coefficient=2e-4)
    series = [1, np.sin(yaw), np.cos(yaw), np.sin(2 * yaw), np.cos(2 * yaw)]
    first = np.array([np.sin(yaw), np.cos(yaw)])
    for report, current, unknown in ((speeds, 2e-4 * 5e4, 0.0), (None, 7.0, 3.0)):
        expected = [*series, *(current * first), *(unknown * first)]
        np.testing.assert_allclose(sensor.error_slopes(motion(yaw, report)), [expected], atol=1e-15)
    np.testing.assert_array_equal(sensor.sampling.errors.deviation, [0.01, 0.02, 0.02, 0.05, 0.05, *[1e-3] * 4])
    np.testing.assert_array_equal(sensor.sampling.errors.correlation_time, [5, *[np.inf] * 4, 60, 60, 10, 10])
    with pytest.raises(BadInput, match="interference"):
        sensor.check(motion(yaw))


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: dvl(correlated_noise=0.01), "correlation_time"),
        (lambda: imu(correlation_time=5.0), "correlated_angle_noise"),
        (lambda: compass(soft_iron=-0.1), "deviation"),
    ],
)
def test_half_an_error_is_none(make, name):
    with pytest.raises(BadInput, match=name):
        make()


@pytest.mark.full
def test_currents_that_no_speed_tells_leave_the_filter_as_unsure_as_it_is():
    """NEES of 40 s and three seeds: 12.8 of 9; 25 where the filter takes the sum of the currents for constant."""
    found = []
    for seed in (0, 3, 7):
        sensors = ["imu", "dvl", "depth", "position_fix"]
        scenario = {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
            "controller": "robust",
            "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0.5]},
            "disturbance": [
                {"kind": "current", "velocity": [0.3, 0.2, 0]},
                {"kind": "waves", "height": 0.5, "period": 5},
            ],
            "navigation": {
                "kind": "kalman",
                "sensors": [*sensors, {"kind": "compass", "interference": 0.002, "assumed_current": 20}],
            },
            "loop": {"dt": 0.02, "duration": 60, "record": 0.1},
            "steady": {"start": 20},
            "seed": seed,
        }
        found.append(ut.simulate_scenario(scenario).result.facts.steady["nees"])
    assert 5 < np.mean(found) < 16


@pytest.mark.full
def test_the_normalised_square_is_that_of_the_inverse():
    rng = np.random.default_rng(0)
    factor, errors = rng.normal(size=(9, 9)) * np.logspace(-4, 2, 9)[:, None], rng.normal(size=9)
    covariance = factor @ factor.T
    expected = errors @ np.linalg.solve(covariance, errors)
    np.testing.assert_allclose(normalised_square(errors, covariance), expected, rtol=1e-6)


@jax.jit
def watched(innovations):
    """The monitor after innovations of one sensor, one every 0.1 s."""
    step = lambda monitor, one: (monitor.updated(0, one, 2.0, np.asarray(True), 0.1), None)
    monitor = jax.lax.scan(step, innovation_monitor([2]), innovations)[0]
    return monitor.rms(), monitor.correlation(), monitor.inconsistent(np.array([0.1]))


def test_the_monitor_tells_large_and_correlated_innovations_from_white_ones():
    rng = np.random.default_rng(3)
    white = rng.normal(size=(300, 2))  # as many as the window has: a plain mean
    rms, correlation, inconsistent = watched(white)
    assert float(rms[0]) == pytest.approx(np.sqrt((white**2).mean()))
    assert float(correlation[0]) == pytest.approx((white[1:] * white[:-1]).sum() / (white**2).sum())
    assert float(inconsistent[0]) == 0
    assert float(watched(1.6 * white)[2][0]) == 1
    alike = (white[1:] + white[:-1]) / np.sqrt(2)
    rms, correlation, inconsistent = watched(np.concatenate([white[:1], alike]))
    assert float(rms[0]) < 1.1 and 0.4 < float(correlation[0]) < 0.6 and float(inconsistent[0]) == 1


ERRORS = [
    {"kind": "imu", "correlated_angle_noise": 0.01, "correlation_time": 5},
    {"kind": "dvl", "correlated_noise": 0.01, "correlation_time": 2},
    "depth",
    {"kind": "compass", "soft_iron": 0.05, "interference": 1e-3},
    "position_fix",
    "propeller_speed",
]


def moving(sensors, **options):
    """A run of a BlueROV2 Heavy that moves and turns."""
    return ut.simulate_scenario(
        {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
            "controller": "robust",
            "reference": {"kind": "lissajous", "amplitude": [2.0, 1.0, 0.5, 0.8], "frequency": [0.2, 0.4, 0.3, 0.25]},
            "navigation": {"kind": "kalman", "sensors": sensors} | options,
            "loop": {"dt": 0.01, "duration": 60, "record": 0.5},
        }
    ).result.facts.navigation


@pytest.mark.full
def test_a_filter_that_is_told_is_consistent_and_one_that_is_not_says_so():
    accurate, wrong = (moving(ERRORS, sensor_error_states=known) for known in (True, False))
    assert accurate["findings"] == [] and 3 < accurate["nees"] < 18
    assert [one["inconsistent"] for one in accurate["sensors"]] == [0.0] * 5  # propeller_speed is not compared
    by_name = {one["sensor"]: one for one in accurate["sensors"]}
    assert by_name["dvl"]["correlated"] == [0.01] * 3 and by_name["dvl"]["correlation_time"] == [2.0] * 3
    assert by_name["compass"]["correlation_time"] == [None, None, 60.0, 60.0, 10.0, 10.0]
    assert wrong["nees"] > 100
    assert {"imu", "dvl", "compass"} <= {one["sensor"] for one in wrong["sensors"] if one["inconsistent"] > 0}
    first, second = wrong["findings"]
    assert "inconsistent with its innovations" in first and "those of dvl are" in first
    assert "times as large as it says" in second
    assert wrong["sensors"][1]["correlated"] == []


@pytest.mark.full
def test_a_constant_error_that_nothing_contradicts_is_in_no_innovation():
    """A vehicle at rest whose compass is bent: the truth alone knows."""
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "controller": "robust",
        "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
        "loop": {"dt": 0.01, "duration": 40, "record": 0.5},
    }
    bent = ["imu", "dvl", "depth", {"kind": "compass", "soft_iron": 0.05}, "position_fix"]
    bent = {"kind": "kalman", "sensors": bent, "sensor_error_states": False}
    said = ut.simulate_scenario(scenario | {"navigation": bent}).result.facts.navigation
    assert all(one["inconsistent"] == 0 for one in said["sensors"])
    assert said["nees"] > 18 and "no innovation shows it" in said["findings"][0]
