"""How far an estimate drifts where no sensor measures: closed forms of integrated white noise and offsets."""

import numpy as np
import pytest

from undertow.control.navigation.drift import drift_advice, drifts
from undertow.control.navigation.observability import Sensed, drift_sentences, unobservable
from undertow.physics.sensors.compass import compass
from undertow.physics.sensors.depth import depth
from undertow.physics.sensors.dvl import dvl
from undertow.physics.sensors.imu import imu
from undertow.physics.sensors.position_fix import position_fix

G, T, PERIOD = 9.81, 100.0, 0.01
ANGLE, RATE, FORCE = 0.002, 0.03, 0.05  # noise
NOISE = {"angle_noise": ANGLE, "rate_noise": RATE, "force_noise": FORCE}
BIAS = {"angle_bias": 0.001, "rate_bias": 0.0004, "force_bias": 0.02}
QUIET = dict.fromkeys(NOISE, 0.0)


def test_position_from_the_acceleration_alone():
    """White noise of density q, integrated twice, is sqrt(q T^3 / 3); an offset b is b T^2 / 2."""
    found = drifts([imu(PERIOD, **NOISE)], 0.1, T)
    tilted = PERIOD * (FORCE**2 + (G * ANGLE) ** 2)
    assert found["north and east"] == pytest.approx(np.sqrt(tilted * T**3 / 3), rel=2e-3)
    assert found["down"] == pytest.approx(np.sqrt(PERIOD * FORCE**2 * T**3 / 3))
    assert found["yaw"] == pytest.approx(np.sqrt(PERIOD * RATE**2 * T))
    offset = drifts([imu(PERIOD, **QUIET, **BIAS)], 0.1, T)
    assert offset["north and east"] == pytest.approx(np.hypot(0.02, G * 0.001) * T**2 / 2, rel=2e-3)
    assert offset["down"] == pytest.approx(0.02 * T**2 / 2) and offset["yaw"] == pytest.approx(0.0004 * T)


def test_position_from_a_velocity():
    """Between readings, period / blend seconds, the acceleration is held; both are integrated once."""
    found = drifts([imu(PERIOD, **NOISE, **BIAS), dvl(0.2, noise=0.004, bias=0.001, resolution=0.0)], 0.25, T)
    held = 0.2 / 0.25
    density, offset = 0.2 * 0.004**2 + PERIOD * (FORCE * held) ** 2, np.hypot(0.001, 0.02 * held)
    assert found["down"] == pytest.approx(np.sqrt(density * T + (offset * T) ** 2))


def test_a_dvl_knows_the_three_velocities_and_no_rate():
    np.testing.assert_array_equal(dvl(noise=0.004).velocity_noise(), [0.004] * 3 + [np.inf] * 3)


def test_what_is_measured_does_not_drift():
    every = [imu(), dvl(), compass(), depth(), position_fix()]
    assert drifts(every, 0.1, T) == {} and drift_advice(every, 0.1, T) == ()
    assert set(drifts(every[:2], 0.1, T)) == {"north and east", "down", "yaw"}
    assert set(drifts(every[:4], 0.1, T)) == {"north and east"}
    assert drifts(every[1:2], 0.1, T) == {}  # without an IMU nothing is known


def test_the_sentence_names_size_and_remedy():
    (says,) = drift_advice([imu(PERIOD, **NOISE), depth(), position_fix()], 0.1, T)
    assert says.startswith("no sensor measures yaw: the estimate drifts by about 1.7 degrees (yaw) in 100 s")
    assert "by noise alone" in says and says.endswith("Add `compass` to `navigation.sensors`")
    (says,) = drift_advice([imu(PERIOD, **NOISE, **BIAS), depth(), compass()], 0.1, T)
    assert "by noise alone" not in says and " m (north and east) in " in says and "Add `position_fix`" in says


def sensed(*axes, deviation=0.1, period=0.5):
    return Sensed(np.eye(15)[list(axes)], np.full(len(axes), deviation**2), period)


def test_a_reading_tells_of_its_derivatives_too():
    """A tilt moves the vehicle as an offset of the accelerometer does; the heading of one at rest shows nowhere."""
    assert unobservable([sensed(12, 13, 14)]) == ["roll", "pitch", "yaw"]
    assert unobservable([sensed(12, 13, 14), sensed(1)]) == ["roll", "yaw"]
    assert unobservable([sensed(14)]) == ["north", "east", "roll", "pitch", "yaw"]
    assert unobservable([]) == ["north", "east", "down", "roll", "pitch", "yaw"]
    assert unobservable([sensed(12, 13, 14), sensed(0, 1, 2)]) == []


def test_the_sentence_of_the_filter():
    initial = np.zeros(15)
    initial[2] = np.radians(5)
    (says,) = drift_sentences([sensed(0, 1, 12, 13, 14)], initial, np.zeros(15), 60.0)
    assert says.startswith("the sensors cannot observe yaw of a vehicle at rest: ")
    assert "about 5 degrees (yaw) in 60 s" in says and says.endswith("Add `compass` to `navigation.sensors`")
    assert drift_sentences([sensed(0, 1, 2, 12, 13, 14)], initial, np.zeros(15), 60.0) == ()
