"""LQI: gains against the Riccati equation, closed-loop response against the matrix exponential, no error under loads."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from undertow.control.controllers import lqi, pid
from undertow.control.controllers.lqi import lqi_gains
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.errors import BadInput
from undertow.core.numerics.riccati import regulator_gain
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, goal, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
def test_gain_is_that_of_the_riccati_equation(seed):
    """Against SciPy's solution by the generalised Schur decomposition."""
    rng = np.random.default_rng(seed)
    a, b, root = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=(4, 4))
    p = solve_discrete_are(a, b[:, None], root @ root.T, np.eye(1))
    found = regulator_gain(*map(jnp.asarray, (a, b, root @ root.T)))
    np.testing.assert_allclose(found, b @ p @ a / (1 + b @ p @ b), rtol=1e-8, atol=1e-10)


def test_gains_without_lag_are_those_of_the_continuous_regulator():
    """Spectral factorisation: K_q = rho w^3, K_v^2 = 2 K_e + (sigma w)^2 and K_e^2 = w^4 + 2 K_q K_v."""
    w, rho, sigma = 2.0, 0.3, 1.5
    q, e, v, a = np.asarray(jax.jit(lqi_gains)(w, rho, sigma, 0.0, 1e-5))
    np.testing.assert_allclose(q, rho * w**3, rtol=1e-4)
    np.testing.assert_allclose(v**2, 2 * e + (sigma * w) ** 2, rtol=1e-4)
    np.testing.assert_allclose(e**2, w**4 + 2 * q * v, rtol=1e-4)
    assert a == 0.0


@pytest.mark.full
def test_lag_is_in_the_design():
    """Poles of the sampled loop with the actuator: symmetric root locus of the continuous design with lag."""
    w, rho, sigma, tau, dt = 3.0, 0.2, 1.0, 0.2, 1e-4
    q, e, v, a = np.asarray(lqi_gains(*map(jnp.asarray, (w, rho, sigma, tau, dt))))
    closed = np.roots([tau, 1 + a, v, e, q])  # tau p^4 + (1 + K_a) p^3 + K_v p^2 + K_e p + K_q
    # p(s) p(-s) = s^6 (tau^2 s^2 - 1) + sigma^2 w^2 s^4 - w^4 s^2 + rho^2 w^6, a polynomial in s^2.
    squares = np.roots([tau**2, -1.0, (sigma * w) ** 2, -(w**4), (rho * w**3) ** 2])
    expected = -np.sqrt(squares.astype(complex))
    np.testing.assert_allclose(np.sort_complex(closed), np.sort_complex(expected), rtol=2e-3)


@pytest.mark.full
def test_error_follows_the_closed_loop_matrix():
    """e, e_dot and the integral under x_ddot = u + d: the matrix exponential, to the order of the sampling time."""
    law = lqi(double_integrator(1).model(), frequency=2.0, integral_weight=0.2, reference_frequency=0.0)
    found = run(double_integrator(1), law, [0.0], duration=5.0, dt=1e-3, position=[0.3])
    q, e, v, _ = np.asarray(law.gains[0])
    matrix = np.array([[0, 1, 0], [-e, -v, -1], [q, 0, 0]])
    for k in (500, 1500, 4000):
        expected = (expm(matrix * found.time[k]) @ [-0.3, 0.0, 0.0])[0]
        np.testing.assert_allclose(found.signals["error"][k, 0], expected, atol=5e-4)


@pytest.mark.full
def test_no_error_under_a_constant_load_within_limits():
    plant = double_integrator(2, limit=4.0)
    law = lqi(plant.model(), sampling_time=1e-2, frequency=3.0)
    found = run(plant, law, [3.0, -3.0], sinusoid(0.0, 1.0, offset=[1.5, -0.5]), duration=60.0)
    np.testing.assert_allclose(found.signals["estimate"][-1], [1.5, -0.5], rtol=1e-6)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


@pytest.mark.full
def test_costs_less_than_pid_at_any_frequency():
    """The integral cost that it minimises, from the same start, against PID with the same share of the integral."""
    plant, w = double_integrator(1), 2.0

    def cost(law):
        found = run(plant, law, [0.0], duration=20.0, position=[1.0])
        e, u, v = (np.asarray(found.signals[name])[:, 0] for name in ("error", "input", "velocity"))
        q = 1e-2 * np.cumsum(e)
        return 1e-2 * float(((0.1 * w**3 * q) ** 2 + (w**2 * e) ** 2 + (w * v) ** 2 + u**2).sum())

    options = {"sampling_time": 1e-2, "reference_frequency": 0.0}
    best = cost(lqi(plant.model(), frequency=w, **options))
    others = [
        cost(pid(plant.model(), frequency=f, damping=z, **options)) for f in (1.5, 2.0, 2.5, 3.0) for z in (0.7, 1)
    ]
    assert best < min(others)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"frequency": -1.0}, "frequency"),
        ({"integral_weight": 0.0}, "integral_weight"),
        ({"rate_weight": [1.0, 2.0]}, "rate_weight"),
        ({"lag": -0.1}, "lag"),
        ({"sampling_time": 0.0}, "sampling_time"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        lqi(double_integrator(1).model(), **wrong)
