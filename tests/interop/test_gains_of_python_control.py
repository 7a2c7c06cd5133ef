"""Gains of lqi beside those of python-control for the same cost."""

import control
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.lqi import lqi_gains

pytestmark = pytest.mark.interop

SHORT = 1e-5  # s: the sampled design is the continuous one


def gains(frequency, integral_weight, rate_weight, lag=0.0, dt=SHORT):
    return np.asarray(lqi_gains(*map(jnp.asarray, (frequency, integral_weight, rate_weight, lag, dt))))


@pytest.mark.parametrize(("w", "rho", "sigma"), [(2.0, 0.1, 1.0), (1.0, 0.5, 2.0), (5.0, 0.2, 0.5)])
def test_gains_of_python_control(w, rho, sigma):
    """`control.lqr` with integral action, of the same cost; its states are position, velocity and integral."""
    plant = control.ss([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), 0)
    cost = np.diag([w**2, sigma * w, rho * w**3]) ** 2
    expected = np.asarray(control.lqr(plant, cost, np.eye(1), integral_action=np.array([[1.0, 0.0]]))[0])[0]
    integral, error, rate, _ = gains(w, rho, sigma)
    np.testing.assert_allclose([error, rate, integral], expected, rtol=2e-4)


@pytest.mark.parametrize("lag", [0.05, 0.3])
def test_gains_of_python_control_with_the_lag_of_actuators(lag):
    """The acceleration that actuators give is a fourth state."""
    w, rho, sigma = 3.0, 0.2, 1.0
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 0] = a[1, 3] = 1.0  # position, velocity, integral, given acceleration
    a[3, 3] = -1 / lag
    cost = np.diag([w**2, sigma * w, rho * w**3, 0.0]) ** 2
    expected = np.asarray(control.lqr(a, [[0.0], [0.0], [0.0], [1 / lag]], cost, np.eye(1))[0])[0]
    integral, error, rate, given = gains(w, rho, sigma, lag)
    np.testing.assert_allclose([error, rate, integral, given], expected, rtol=1e-3)
