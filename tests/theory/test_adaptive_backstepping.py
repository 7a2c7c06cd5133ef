"""Adaptive backstepping: the error equation and its Lyapunov function through a lag, limits, and a PID without one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from undertow.control.controllers import adaptive_backstepping, pid
from undertow.control.controllers.adaptive_backstepping import steps
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

C, INNER, GAMMA, LOAD = 2.0, 5.0, 1.2, 0.7


def run(plant, law, goal, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.fixture(scope="module", params=[0.05, 0.3])
def through_a_lag(request):
    """Time, (z_1, z_2, z_3, d - d_hat) and dt of a double integrator behind a lag under a constant load."""
    lag, dt = request.param, 1e-4
    law = adaptive_backstepping(
        double_integrator(1).model(), sampling_time=dt, lag=lag, rate=C, inner_rate=INNER, adaptation=GAMMA,
        reference_frequency=0.0,
    )  # fmt: skip
    r = Target(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1))

    def step(state, _):
        x, v, given, z = state
        y = Measurement(x, v)
        u, _ = law.command(z, y, r)
        at = steps(-x, -v, 0.0, z.law.load, given, C, INNER, GAMMA, lag)
        kept = jnp.exp(-dt / lag)
        after = u + (given - u) * kept
        mean = u + (given - u) * (1 - kept) * lag / dt + LOAD
        there = jnp.concatenate([-x, at.second, at.third, LOAD - z.law.load])
        return (x + dt * v + dt**2 / 2 * mean, v + dt * mean, after, law.advance(z, y, r, u, dt)), there

    y = Measurement(jnp.array([0.4]), jnp.zeros(1))
    _, found = jax.lax.scan(step, (y.position, y.velocity, jnp.zeros(1), law.init(y, r)), length=60_000)
    return dt * np.arange(60_000), np.asarray(found), dt


@pytest.mark.full
def test_errors_follow_their_linear_equation_whatever_the_lag(through_a_lag):
    time, found, _ = through_a_lag
    matrix = np.array([[-C, 1, 0, 0], [-(C**2), -C, 1, -1], [0, -(C**2), -INNER, -2 * C], [0, GAMMA, 2 * GAMMA / C, 0]])
    for k in (2_000, 10_000, 40_000):
        expected = expm(matrix * time[k]) @ found[0]
        np.testing.assert_allclose(found[k], expected, atol=2e-3)


@pytest.mark.full
def test_lyapunov_function_falls_as_in_the_theorem(through_a_lag):
    _, found, dt = through_a_lag
    z1, z2, z3, away = found.T
    value = (C**2 * z1**2 + z2**2 + z3**2 / C**2) / 2 + away**2 / (2 * GAMMA)
    lost = C**3 * z1**2 + C * z2**2 + INNER * z3**2 / C**2
    assert np.diff(value).max() < 1e-6 * value[0]
    np.testing.assert_allclose(value[0] - value[20_000], dt * lost[:20_000].sum(), rtol=5e-3)
    assert abs(away[-1]) < 0.02 * LOAD


@pytest.mark.full
def test_without_lag_it_is_a_pid():
    plant = double_integrator(1)
    law = adaptive_backstepping(plant.model(), rate=C, adaptation=GAMMA, reference_frequency=0.0)
    assert not law.lagged
    same = pid(plant.model(), gains=[2 * C**2 + GAMMA, GAMMA * C, 2 * C], reference_frequency=0.0)
    load = sinusoid(0.3, 1.0, offset=0.2)
    ours, theirs = (run(plant, one, [0.0], load, duration=10.0, dt=1e-3) for one in (law, same))
    np.testing.assert_allclose(ours.signals["error"], theirs.signals["error"], atol=2e-4)


@pytest.mark.full
def test_estimate_waits_at_limits_and_stays_within_its_bound():
    plant = double_integrator(1, limit=1.5)
    options = {"sampling_time": 1e-2, "rate": 1.0, "reference_frequency": 0.0}
    law = adaptive_backstepping(plant.model(), **options)
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=-1.0), duration=90.0)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-4)
    weak = adaptive_backstepping(plant.model(), **options, bound=0.5)
    held = run(plant, weak, [0.0], sinusoid(0.0, 1.0, offset=-1.0), duration=60.0)
    np.testing.assert_allclose(held.signals["estimate"][-1], -0.5)
    # The rest of the load is balanced by an error: 2 c^2 e = 0.5 m/s^2.
    np.testing.assert_allclose(held.signals["error"][-1], 0.25, rtol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"rate": -1.0}, "rate"),
        ({"inner_rate": 0.0}, "inner_rate"),
        ({"adaptation": -1.0}, "adaptation"),
        ({"bound": 0.0}, "bound"),
        ({"lag": -0.1}, "lag"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        adaptive_backstepping(double_integrator(1).model(), **wrong)
