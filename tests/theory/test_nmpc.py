"""Model predictive control: the regulator without limits, the exact optimum with them, a nonlinear problem, bad options."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import lsq_linear, minimize

from undertow.control.controllers import disturbance_observer, nmpc
from undertow.control.controllers.receding_horizon import Horizon, improved, regulator
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, two_link_arm
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

DT = 1e-2


def horizon(limit=1e6, w=(2.0,), h=0.1):
    w, m = jnp.array(w), len(w)
    return Horizon(jnp.asarray(h), w**4, 2 * w**2, jnp.full(m, -limit), jnp.full(m, limit))


def run(plant, law, goal, disturbance=None, duration=4.0, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=DT, record_every=1, **start)


def condensed(h, steps, w):
    """Weighted residuals of one axis of unit mass as a linear function of the start and of the forces."""
    a, b = np.array([[1.0, h], [0.0, 1.0]]), -np.array([h**2 / 2, h])
    q, end = (
        np.diag([w**4, 2 * w**2]) * h,
        solve_discrete_are(a, b[:, None], np.diag([w**4, 2 * w**2]) * h, h * np.eye(1)),
    )
    rows_of_start, rows_of_force, state, force = [], [], np.eye(2), np.zeros((2, steps))
    for k in range(steps):
        rows_of_start += [np.sqrt(q) @ state, np.zeros((1, 2))]
        chosen = np.zeros((1, steps))
        chosen[0, k] = np.sqrt(h)
        rows_of_force += [np.sqrt(q) @ force, chosen]
        state, force = a @ state, a @ force + np.outer(b, np.eye(steps)[k])
    root = np.linalg.cholesky(end).T
    return np.vstack([*rows_of_start, root @ state]), np.vstack([*rows_of_force, root @ force])


LINEAR = lambda t, state: (jnp.zeros(1), -jnp.eye(1))


@functools.partial(jax.jit, static_argnums=0)
def once(motion, limits, start, forces):
    return improved(motion, limits, start, forces)


again_and_again = jax.jit(
    lambda motion, limits, start, forces, rounds: jax.lax.fori_loop(
        0, rounds, lambda _, forces: improved(motion, limits, start, forces).forces, forces
    ),
    static_argnums=0,
)


@pytest.mark.full
@pytest.mark.parametrize(("w", "h"), [(2.0, 0.1), (8.0, 0.02), (0.3, 0.2)])
def test_the_end_is_that_of_the_discrete_riccati_equation(w, h):
    cost, gain = regulator(horizon(w=(w, 2 * w), h=h))
    for axis, rate in enumerate((w, 2 * w)):
        a, b = np.array([[1.0, h], [0.0, 1.0]]), np.array([[h**2 / 2], [h]])
        exact = solve_discrete_are(a, b, np.diag([rate**4, 2 * rate**2]) * h, h * np.eye(1))
        np.testing.assert_allclose(cost[axis], exact, rtol=1e-9)
        expected = np.linalg.solve(h * np.eye(1) + b.T @ exact @ b, b.T @ exact @ a)
        np.testing.assert_allclose(gain[axis], expected[0], rtol=1e-9)


@pytest.mark.full
def test_without_limits_one_step_gives_the_regulator():
    """For any length of the horizon; to the small cost of the forces themselves."""
    start = jnp.array([0.7, -0.4])
    gain = regulator(horizon())[1][0]
    for steps in (2, 10):
        found = once(LINEAR, horizon(), start, jnp.zeros((steps, 1)))
        np.testing.assert_allclose(found.forces[0, 0], gain @ start, rtol=1e-7)
        np.testing.assert_allclose(found.gain[0], gain, rtol=1e-7)


@pytest.mark.full
@pytest.mark.parametrize("start", [(2.0, 0.0), (1.0, 1.5), (-3.0, 0.2)])
def test_with_limits_it_ends_at_the_exact_optimum(start):
    """Against the box-constrained least squares of scipy for the condensed problem."""
    h, steps, limit, w = 0.1, 15, 1.5, 2.0
    of_start, of_force = condensed(h, steps, w)
    exact = lsq_linear(of_force, -of_start @ np.array(start), bounds=(-limit, limit), tol=1e-14).x
    forces = again_and_again(LINEAR, horizon(limit), jnp.array(start), jnp.zeros((steps, 1)), 12)
    assert (np.abs(exact) > limit * (1 - 1e-6)).any()  # limits do bind
    np.testing.assert_allclose(forces[:, 0], exact, atol=1e-5)


def test_the_gain_of_a_plan_is_that_of_its_first_force():
    """Where forces work better from step to step, so that no two steps have the same gain."""
    stronger = lambda t, state: (jnp.zeros(1), -(1.0 + 2.0 * t) * jnp.eye(1))
    plans = [once(stronger, horizon(), jnp.array(start), jnp.zeros((6, 1))) for start in ([0, 0.0], [1, 0.0], [0, 1.0])]
    here, *beside = (np.asarray(plan.forces[:, 0]) for plan in plans)
    slopes = np.stack(beside, -1) - here[:, None]
    np.testing.assert_allclose(plans[0].gain[0], slopes[0], rtol=1e-9)
    assert np.abs(slopes[-1] - slopes[0]).max() > 0.1


# Forces of the nonlinear problem below for limits of 4, by IPOPT (tolerance 1e-12) through CasADi 3.8.2.
IPOPT = [4.0, 3.9525671, 3.3038237, 2.7281681, 2.2396447, 1.8370436, 1.5108831, 1.2488662]


def bent(t, state):
    """Motion like that of a pendulum with drag whose effectiveness depends on the angle."""
    error, rate = state[:1], state[1:]
    return 2 * jnp.sin(error) + 0.5 * rate * jnp.abs(rate), -(1.0 + 0.3 * jnp.cos(error))[:, None]


def converged(limit, rounds):
    start = jnp.array([1.2, 0.3])
    return again_and_again(bent, horizon(limit, (1.5,)), start, jnp.zeros((8, 1)), rounds)[:, 0]


def test_a_nonlinear_problem_ends_where_ipopt_does():
    np.testing.assert_allclose(converged(4.0, 5), IPOPT, atol=2e-7)


@jax.jit
@jax.value_and_grad
def with_slope(forces, end):
    """Cost of the forces of the nonlinear problem, and its gradient."""
    h, w, s, total = 0.1, 1.5, jnp.array([1.2, 0.3]), 0.0
    for k in range(8):
        free, per_force = bent(k * h, s)
        bend = (free + per_force @ forces[k : k + 1])[0]
        total += h / 2 * (w**4 * s[0] ** 2 + 2 * w**2 * s[1] ** 2 + bend**2)
        s = jnp.stack([s[0] + h * s[1] + h**2 / 2 * bend, s[1] + h * bend])
    return total + s @ end @ s / 2


@pytest.mark.full
@pytest.mark.parametrize("limit", [3.0, 3.5, 10.0])
def test_a_nonlinear_problem_ends_at_a_minimum_that_another_method_finds(limit):
    """L-BFGS-B, for limits that bind in several steps, in some and in none."""
    bounds = [(-limit, limit)] * 8
    end = regulator(horizon(limit, (1.5,)))[0][0]
    cost = lambda forces: with_slope(forces, end)[0]
    exact = minimize(with_slope, np.zeros(8), (end,), jac=True, bounds=bounds, tol=1e-14)
    found = converged(limit, 10)
    assert float(cost(found)) <= exact.fun * (1 + 1e-9)
    np.testing.assert_allclose(found, exact.x, atol=1e-3)
    bound = (np.abs(found) > limit - 1e-9).sum()
    assert (bound > 0) == (limit < 10) and bound < 8


@pytest.mark.full
def test_far_from_limits_the_loop_is_that_of_the_disturbance_observer():
    """With the regulator's gains instead of w^2 and 2 w: on an arm, whose model is nonlinear, with a load."""
    plant, load = two_link_arm(), sinusoid(0.3, 2.0, offset=[1.0, -0.5])
    same = {"sampling_time": DT, "bandwidth": 5.0, "reference_frequency": 1.0}
    law = nmpc(plant.model(), tracking=2.0, horizon=0.4, steps=8, **same)
    gain = regulator(law._horizon(Measurement(jnp.zeros(2), jnp.zeros(2))))[1][0]
    w = float(jnp.sqrt(gain[0]))
    like = disturbance_observer(plant.model(), tracking=w, damping=float(gain[1]) / (2 * w), **same)
    found, expected = (run(plant, one, [0.4, -0.3], load, 3.0).signals["error"] for one in (law, like))
    np.testing.assert_allclose(found, expected, atol=0.01 * float(np.abs(expected).max()))


@pytest.mark.full
def test_it_brakes_in_time_where_feedback_overshoots():
    """A step of 5 m with 1.5 m/s^2 at hand: the same gains without prediction overshoot by more than ten times."""
    plant = double_integrator(1, limit=1.5)
    same = {"sampling_time": DT, "tracking": 3.0, "bandwidth": 5.0, "reference_frequency": 0.0}
    laws = nmpc(plant.model(), horizon=4.0, steps=20, **same), disturbance_observer(plant.model(), **same)
    predictive, feedback = (-float(run(plant, law, [5.0], duration=12.0).signals["error"].min()) for law in laws)
    assert predictive < 0.1 * feedback, (predictive, feedback)


@pytest.mark.full
def test_a_prediction_that_is_not_finite_leaves_the_regulator():
    model = double_integrator(2).model()
    law = nmpc(model, sampling_time=DT, tracking=2.0, reference_frequency=0.0)
    y, goal = Measurement(jnp.zeros(2), jnp.zeros(2)), Target(jnp.array([0.1, 0.2]), jnp.zeros(2), jnp.zeros(2))
    z = law.init(y, goal)
    plan = z.law.plan._replace(forces=jnp.full_like(z.law.plan.forces, jnp.nan))
    z = z._replace(law=z.law._replace(plan=plan, elapsed=jnp.asarray(DT)))
    gain = regulator(law._horizon(y))[1]
    u, _ = law.command(z, y, goal)
    np.testing.assert_allclose(u, gain[:, 0] * goal.position, rtol=1e-12)
    after = law.advance(z, y, goal, u, jnp.asarray(DT))
    assert np.isfinite(after.law.plan.forces).all()


@pytest.mark.parametrize(("key", "value"), [("steps", 1), ("iterations", 0), ("horizon", 0.0), ("tracking", -1.0)])
def test_options_that_no_horizon_can_have(key, value):
    with pytest.raises(BadInput, match=key):
        nmpc(double_integrator(6).model(), **{key: value})
