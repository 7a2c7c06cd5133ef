"""Integrators: exact orders on a smooth problem, and jumps at step boundaries that are met, not smeared (I33)."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Load
from undertow.core.numerics.integrators import METHODS, rk4
from undertow.physics.disturbances import u1
from undertow.physics.plants import double_integrator


def integrate(step, field, start, duration, steps):
    """State after `steps` equal steps."""
    dt = duration / steps

    return _integrate(step, field, start, np.asarray(dt), np.asarray(steps))


@functools.partial(jax.jit, static_argnums=(0, 1))
def _integrate(step, field, start, dt, steps):
    return jax.lax.fori_loop(0, steps, lambda k, state: step(field, k.astype(float) * dt, state, dt), start)


def pendulum(t, state):
    """A driven, damped pendulum: nonlinear, explicit in time, smooth; a pytree as state."""
    return {"angle": state["rate"], "rate": -jnp.sin(state["angle"]) - 0.1 * state["rate"] + jnp.cos(2 * t)}


def orders(errors):
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


@pytest.mark.parametrize(("method", "order", "steps"), [("euler", 1, 400), ("rk4", 4, 50)])
def test_order_on_a_smooth_problem(method, order, steps):
    start = {"angle": jnp.asarray(0.5), "rate": jnp.asarray(-0.3)}
    truth = integrate(rk4, pendulum, start, 5.0, 6400)
    errors = []
    for factor in (1, 2, 4):
        end = integrate(METHODS[method], pendulum, start, 5.0, factor * steps)
        errors.append(max(abs(float(end[name] - truth[name])) for name in truth))
    assert errors[0] < 0.05
    np.testing.assert_allclose(orders(errors), order, atol=0.2)


def test_rk4_agrees_with_the_exponential_to_its_taylor_series():
    """One step of y' = y is 1 + h + h^2/2 + h^3/6 + h^4/24."""
    h = 0.3
    end = rk4(lambda t, y: y, jnp.zeros(()), jnp.ones(()), jnp.asarray(h))
    np.testing.assert_allclose(end, 1 + h + h**2 / 2 + h**3 / 6 + h**4 / 24, rtol=1e-15)


def smearing_rk4(field, t, y, dt):
    """The textbook method, stages exactly on the boundaries."""
    ahead = lambda share, rate: jax.tree.map(lambda a, b: a + share * dt * b, y, rate)
    k1 = field(t, y)
    k2 = field(t + dt / 2, ahead(0.5, k1))
    k3 = field(t + dt / 2, ahead(0.5, k2))
    k4 = field(t + dt, ahead(1.0, k3))
    return jax.tree.map(lambda a, *k: a + dt / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3]), y, k1, k2, k3, k4)


def step_up(t, state):
    """Rates of an integral of a jump from 0 to 1, and of the time of the jump, which is a part of the state."""
    _, jump = state
    return jnp.where(t >= jump, 1.0, 0.0), jnp.zeros(())


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("jump", [0.3, 0.7, 1.0])  # 3 * 0.1 and 7 * 0.1 are not these numbers in floating point
def test_jump_at_a_step_boundary_is_met(method, jump):
    end, _ = integrate(METHODS[method], step_up, (0.0, jump), 2.0, 20)
    np.testing.assert_allclose(end, 2.0 - jump, rtol=0, atol=1e-14)


def test_textbook_rk4_smears_the_same_jump_by_a_sixth_of_a_step():
    end, _ = integrate(smearing_rk4, step_up, (0.0, 1.0), 2.0, 20)
    np.testing.assert_allclose(end, 1.0 + 0.1 / 6, rtol=0, atol=1e-14)


@pytest.mark.full
def test_suite_u1_keeps_rk4_at_fourth_order_across_all_of_its_jumps():
    """I33 on a plant: 15 s of steps, square wave, pulse and chirp on six axes; jumps at 2, 4, 6, 8, 10, 12, 14 s."""
    plant, suite = double_integrator(axes=6), u1()
    calm = Load(jnp.zeros(6), jnp.zeros(6))

    def motion(t, x):
        return plant.dynamics(t, x, jnp.zeros(6), suite.at((), t, None, calm))

    start = plant.initial_state()
    truth = integrate(rk4, motion, start, 15.0, 48000)
    ends = [integrate(rk4, motion, start, 15.0, steps) for steps in (750, 1500, 3000)]
    errors = [np.abs(np.concatenate(end) - np.concatenate(truth)).max() for end in ends]
    assert errors[0] < 1e-3
    assert (orders(errors) >= 3.8).all()
