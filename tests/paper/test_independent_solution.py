"""Examples 1 and 2 against an independent plain-NumPy solution, and against the published reference figures."""

import numpy as np
import pytest

from undertow.paper.all_outputs import with_all_outputs
from undertow.paper.setup import CONTROLLERS, scenario
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.speed.plain_numpy import ALPHA, CQ, CT, K3, KE, KF, KT, M_INV, B, R, jacobian, law, rk4, suite_u1

pytestmark = pytest.mark.full

# Benchmark definitions, section 4: tracking, estimation, uncertainty and robust rms on fidelity `ideal`, suite U1.
REFERENCE = {
    "rcafc": {"tracking_rms": 1.6e-4, "estimation_rms": 0.201, "uncertainty_rms": 3.224, "robust_rms": 0.144},
    "rafc": {"tracking_rms": 7.22e-3, "estimation_rms": 1.607, "uncertainty_rms": 3.224, "robust_rms": 1.579},
}


K2 = KE + R * KF / KT  # Eqs. (8) and (9)


def paper_example(fidelity, composite, duration=20.0, h=1e-3, every=10):
    """Examples 1 (`ideal`) and 2 (`static`) as one ODE: e, d_hat - d and u_r at 10 ms from 10 s on."""

    def thrust(voltage):
        if fidelity == "ideal":
            return ALPHA * voltage
        speed = 2 * voltage / (K2 + np.sqrt(K2**2 + 4 * K3 * CQ * np.abs(voltage)))
        return CT * speed * np.abs(speed)

    def rate(t, y):
        eta, eta_dot = y[:2]
        voltage, v_hat_dot, theta_dot, (_, _, _, known) = law(y[0], y[1], y[2], y[3], composite)
        unexplained = jacobian(eta) @ M_INV @ B @ (thrust(voltage) - ALPHA * voltage)
        return eta_dot, known + unexplained + suite_u1(t), v_hat_dot, theta_dot

    y, kept = (np.zeros(6), np.zeros(6), np.zeros(6), np.zeros((6, 5))), []
    for k in range(round(duration / h) + 1):
        if k % every == 0 and k * h >= 10 - 1e-9:
            voltage, _, _, (e, d_hat, u_r, _) = law(y[0], y[1], y[2], y[3], composite)
            d = jacobian(y[0]) @ M_INV @ B @ (thrust(voltage) - ALPHA * voltage) + suite_u1(k * h)
            kept.append((e, d_hat - d, u_r))
        y = rk4(rate, k * h, y, h)
    return tuple(np.array(series) for series in zip(*kept, strict=True))


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_example_1_gives_the_reference_figures(controller):
    run = run_scenario(scenario("", composite=CONTROLLERS[controller]))
    for metric, expected in REFERENCE[controller].items():
        np.testing.assert_allclose(with_all_outputs(run.steady)[metric], expected, rtol=0.02)


def check(run, solution):
    for metric, series in zip(("tracking_rms", "estimation_rms", "robust_rms"), solution, strict=True):
        np.testing.assert_allclose(run[metric], np.sqrt((series**2).mean()), rtol=0.02)


# From 10 s to 12 s with steps of 2 ms, because plain NumPy takes its time. By default a second of the full motor model is
# compared with it, in studies/test_speed.
@pytest.mark.slow
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_example_2_agrees_with_plain_numpy(controller):
    loop = {"kind": "continuous", "duration": 12.0}
    window = {"start": 10.0, "stop": 12.0}
    run = run_scenario(scenario("", fidelity="static", composite=CONTROLLERS[controller], loop=loop, steady=window))
    check(
        with_all_outputs(run.steady), paper_example("static", CONTROLLERS[controller], duration=12.0, h=2e-3, every=5)
    )


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["ideal", "static"])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_examples_agree_with_plain_numpy_throughout(fidelity, controller):
    run = run_scenario(scenario("", fidelity=fidelity, composite=CONTROLLERS[controller]))
    check(with_all_outputs(run.steady), paper_example(fidelity, CONTROLLERS[controller]))
