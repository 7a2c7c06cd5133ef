"""The tables of theory.md sections 3.1 to 3.4, to the digits printed there: the linear module against the page."""

import axis_forms
import numpy as np
import pytest

from undertow.analysis import small_signal

RAFC = {"composite": 0.0}
LAYOUTS = {"one": {"sets": 1}, "three": {}, "five": {"sets": 5}, "half": {"width": 2.0}}
# layout: rho, b2, w_o, zeta, pair of RCAFC, its fast pole, poles of RAFC, pair of RAFC with w_bar = 0
POLES = {
    "one": (1.0, 50000, 223.6, 0.336, -74.8 + 212j, -101.5, (-1, -5.2, -95.8), -0.5 + 22.4j),
    "three": (0.4217, 21087, 145.2, 0.517, -74.8 + 125j, -101.6, (-1, -2.13, -98.9), -0.5 + 14.5j),
    "five": (0.4047, 20235, 142.3, 0.528, -74.8 + 122j, -101.6, (-1, -2.05, -99), -0.5 + 14.2j),
    "half": (0.3383, 16916, 130.1, 0.577, -74.8 + 107j, -101.7, (-1, -1.70, -99.3), -0.5 + 13j),
}
FREQUENCIES = np.array([0.5, 1, 5, 20, 50, 100, 200])
RESPONSES = {
    "rcafc": ({}, [0.0035, 0.0070, 0.0351, 0.143, 0.390, 0.961, 1.416]),
    "rafc": (RAFC, [0.233, 0.434, 0.940, 1.015, 1.016, 1.011, 1.004]),
}
ERRORS = {
    "rcafc": ({}, [3.11e-5, 4.91e-5, 6.81e-5, 6.93e-5, 6.92e-5, 6.76e-5, 3.16e-5]),
    "rafc": (RAFC, [2.06e-3, 3.04e-3, 1.82e-3, 4.9e-4, 1.8e-4, 7.1e-5, 2.2e-5]),
    "pd": ({"adaptation": 0.0}, [8.9e-3, 7.0e-3, 1.9e-3, 4.9e-4, 1.8e-4, 7.0e-5, 2.2e-5]),
}


def printed(value, digits):
    """Relative slack of a number rounded to so many digits."""
    return pytest.approx(value, rel=0.5 * 10.0 ** (1 - digits) * 1.1)


def contains(values, wanted, digits):
    distance = np.abs(values - wanted).min()
    return distance <= abs(wanted) * 0.6 * 10.0 ** (1 - digits)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_poles_are_those_of_section_3_3(table1, layout):
    rho, b2, frequency, damping, pair, fast, rafc, undamped = POLES[layout]
    law = table1(**LAYOUTS[layout])
    assert float(law.fuzzy.basis_norm_squared()) == printed(rho, 4)
    assert small_signal.gains(law).b2 == printed(b2, 5)
    assert small_signal.observer_frequency(law) == printed(frequency, 4)
    assert small_signal.observer_damping(law) == printed(damping, 3)
    poles = small_signal.poles(law)
    assert contains(poles, -1, 12), "the sliding line is a pole, whatever the other gains"
    assert contains(poles, pair, 3) and contains(poles, fast, 4)
    slow = small_signal.poles(table1(**LAYOUTS[layout], **RAFC))
    assert all(contains(slow, pole, 2) for pole in rafc)
    assert contains(small_signal.poles(table1(**LAYOUTS[layout], **RAFC, robust_gain=0.0)), undamped, 2)


@pytest.mark.parametrize("case", RESPONSES)
def test_estimation_response_is_that_of_section_3_4(table1, case):
    choices, magnitudes = RESPONSES[case]
    response = np.abs(small_signal.estimation_response(table1(**choices), FREQUENCIES))
    np.testing.assert_allclose(response, magnitudes, rtol=2e-3, atol=5e-5)


@pytest.mark.parametrize("case", ERRORS)
def test_tracking_response_is_that_of_section_3_4(table1, case):
    choices, magnitudes = ERRORS[case]
    response = np.abs(axis_forms.tracking_response(table1(**choices), FREQUENCIES))
    np.testing.assert_allclose(response, magnitudes, rtol=2e-3 if case == "rcafc" else 2.5e-2)


def test_estimate_is_worse_than_none_above_103_rad_per_s(table1):
    law = table1()
    crossing = small_signal.crossing_frequency(law)
    assert crossing == printed(103.0, 3)
    below, above = np.abs(small_signal.estimation_response(law, np.array([0.99, 1.01]) * crossing))
    assert below < 1 < above
    assert crossing == pytest.approx(np.sqrt(small_signal.gains(law).b2 / 2), rel=0.02)


def test_section_3_1_composite_branch_alone_is_a_linear_observer(table1):
    """d_til / d = -p (p + a1) / (p^2 + a1 p + b2) once s is left out, and nearly so at Table 1."""
    p = 1j * FREQUENCIES
    law = table1(weight=((1e-12, 0.0), (0.0, 1e-12)))
    g = small_signal.gains(law)
    observer = -p * (p + g.pole) / (p**2 + g.pole * p + g.b2)
    np.testing.assert_allclose(small_signal.estimation_response(law, FREQUENCIES), observer, rtol=1e-9)
    whole = small_signal.estimation_response(table1(), FREQUENCIES)
    assert 1e-3 < np.abs(whole / observer - 1).max() < 0.02


def test_section_3_1_is_the_transfer_function_written_out(table1):
    p = 1j * FREQUENCIES
    g = small_signal.gains(table1())
    assert (g.stiffness, g.damping) == pytest.approx((101, 102)), "the hidden PD"
    loop = g.adaptation / p * (5 / (p + 101) + 500 / (p + 150.2))
    d_til = -1 / (1 + loop)
    np.testing.assert_allclose(small_signal.estimation_response(table1(), FREQUENCIES), d_til, rtol=1e-10)
    error = d_til / ((p + 1) * (p + 101))
    np.testing.assert_allclose(axis_forms.tracking_response(table1(), FREQUENCIES), error, rtol=1e-10)


def test_gains_from_disturbance_rate(table1):
    error, d_til = axis_forms.peak_gains(table1())
    assert error == pytest.approx(6.95e-5, rel=5e-3) and d_til == pytest.approx(0.01165, rel=5e-3)
    slow_error, slow_d_til = axis_forms.peak_gains(table1(**RAFC))
    assert slow_error == printed(4.74e-3, 3) and slow_d_til == printed(0.479, 3)
    assert small_signal.ramp_error(table1(**RAFC))[0] / small_signal.ramp_error(table1())[0] == printed(68.0, 2)
    assert small_signal.ramp_error(table1())[1] == pytest.approx(0.00712, rel=0.02)
