"""pid and lqi: gains of textbooks."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from undertow.control.controllers import pid
from undertow.control.controllers.lqi import lqi_gains
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.physics.disturbances import none
from undertow.physics.plants import double_integrator, two_link_arm
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

SHORT = 1e-5  # s: the sampled design is the continuous one


def gains(frequency, integral_weight, rate_weight, lag=0.0, dt=SHORT):
    return np.asarray(lqi_gains(*map(jnp.asarray, (frequency, integral_weight, rate_weight, lag, dt))))


def test_gains_of_fossens_pole_placement():
    """K_p = m w^2, K_d = 2 zeta w m, K_i = w K_p / 10: Fossen (2021), Algorithm 15.2, as in PIDnonlinearMIMO.m of MSS.

    For the Otter's w = 2.5 rad/s and zeta = 1 they are 6.25, 5 and 1.5625 for each unit of inertia.
    """
    law = pid(double_integrator(1).model(), frequency=2.5, damping=1.0)
    np.testing.assert_allclose([law.proportional, law.derivative, law.integral], [6.25, 5.0, 1.5625])


def arm_under_proportional_and_derivative_torques(t, state):
    """Slotine and Li (1991), Example 9.1: tau = -K_p (q - q_d) - K_d q_dot with K_d = 100 I and K_p = 20 K_d."""
    q, v = np.split(state, 2)
    a1, a2, a3, a4 = 3.34, 0.97, 1.2 * np.cos(np.pi / 6), 1.2 * np.sin(np.pi / 6)
    c, h = a3 * np.cos(q[1]) + a4 * np.sin(q[1]), a3 * np.sin(q[1]) - a4 * np.cos(q[1])
    tau = 2000 * (GOAL - q) - 100 * v + h * np.array([(2 * v[0] + v[1]) * v[1], -(v[0] ** 2)])
    return np.concatenate([v, np.linalg.solve([[a1 + 2 * c, a2 + c], [a2 + c, a2]], tau)])


GOAL = np.radians([60.0, 90.0])


@pytest.mark.full
def test_position_of_an_arm_by_proportional_and_derivative_control():
    """From rest at zero, for one second: with unit masses as its model the law gives these torques."""
    plant, dt = two_link_arm(gravity=0.0), 1e-3
    law = pid(double_integrator(2).model(), sampling_time=dt, gains=(2000.0, 0.0, 100.0), reference_frequency=0.0)
    loop = ClosedLoop(plant, law, setpoint(GOAL), none(), perfect())
    found = np.asarray(sampled.simulate(loop, duration=1.0, dt=dt, record_every=1).signals["position"])
    time = dt * np.arange(1001)
    expected = solve_ivp(arm_under_proportional_and_derivative_torques, (0, 1), np.zeros(4), t_eval=time, rtol=1e-8)
    np.testing.assert_allclose(found, expected.y[:2].T, atol=0.02 * GOAL.max())
    np.testing.assert_allclose(found[-1], GOAL, atol=1e-3)


@pytest.mark.full
def test_regulator_of_the_double_integrator():
    """Q = I and R = 1 give K = (1, sqrt(3)), the Riccati equation solved by hand. Without the integral here."""
    integral, error, rate, given = gains(1.0, 1e-9, 1.0)
    np.testing.assert_allclose([error, rate], [1.0, np.sqrt(3)], rtol=1e-4)
    assert abs(integral) < 1e-8 and given == 0.0
