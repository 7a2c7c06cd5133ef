import numpy as np
import pytest

from undertow.paper.thruster_response import thruster_response
from undertow.physics.thrusters.paper_table3 import paper_table3

MOTOR = paper_table3().motor


@pytest.fixture(scope="module")
def response():
    return thruster_response()


def test_periods_are_the_papers_voltages_and_close(response):
    for period, frequency in ((response.long, 1.0), (response.short, 10.0)):
        np.testing.assert_allclose(period.voltage, 10 * np.sin(frequency * period.time), atol=1e-9)
        step = period.time[1] - period.time[0]
        assert period.time[-1] + step == pytest.approx(2 * np.pi / frequency)
        half = len(period.time) // 2  # the motor is odd: a settled period is its own mirror image
        np.testing.assert_allclose(period.thrust[half:], -period.thrust[:half], atol=1e-6)
        np.testing.assert_allclose(period.current[half:], -period.current[:half], atol=1e-6)


def test_motor_obeys_eqs_8_to_11(response):
    period = response.short
    step = period.time[1] - period.time[0]
    slope = lambda x: (np.roll(x, -1) - np.roll(x, 1)) / (2 * step)
    speed = np.sign(period.thrust) * np.sqrt(np.abs(period.thrust) / MOTOR.thrust_coefficient)
    volts = (
        MOTOR.inductance * slope(period.current) + MOTOR.resistance * period.current + MOTOR.back_emf_constant * speed
    )
    np.testing.assert_allclose(volts, period.voltage, atol=2e-3)  # Eq. (9), central differences


def test_laws_are_least_squares_fits_of_the_long_period(response):
    linear, quadratic, current = response.laws
    V, T, I = response.long.voltage, response.long.thrust, response.long.current  # noqa: E741
    assert linear.coefficient == pytest.approx(np.linalg.lstsq(V[:, None], T)[0][0])
    assert quadratic.coefficient == pytest.approx(np.linalg.lstsq((V * abs(V))[:, None], T)[0][0])
    assert current.coefficient == pytest.approx(np.linalg.lstsq(T[:, None], I)[0][0])


def test_laws_hold_for_the_long_period_only(response):
    expected = {"T = c_0 V": (9.5, 67.3), "T = c_V V|V|": (14.2, 69.4), "I = c_I T": (8.8, 53.2)}
    for law in response.laws:
        assert (law.error_long, law.error_short) == pytest.approx(expected[law.text], abs=0.1)


def test_alpha_v_misses_what_theory_u1_says(response):
    for period, share in ((response.long, 0.66), (response.short, 1.27)):
        missed = period.thrust - float(MOTOR.voltage_gain) * period.voltage
        assert np.sqrt(np.mean(missed**2) / np.mean(period.thrust**2)) == pytest.approx(share, abs=0.02)
