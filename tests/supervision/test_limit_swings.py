"""Swings of an input between its limits: their number per second, and what counts as one."""

import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.supervision.limit_swings import AVERAGED, no_swings, swung

LOW, HIGH, STEP = np.array([-16.0, -16.0, 0.0, -np.inf]), np.array([16.0, 8.0, 10.0, np.inf]), 0.02


def rates(inputs):
    """Swings per second of each input after every step."""

    def one(state, u):
        state = swung(state, u, jnp.asarray(LOW), jnp.asarray(HIGH), jnp.asarray(STEP))
        return state, state.rate

    inputs = jnp.asarray(np.broadcast_to(inputs, (len(inputs), 4)))
    return np.asarray(jax.lax.scan(one, no_swings(inputs[0]), inputs)[1])


def test_a_square_wave_swings_twice_in_a_period():
    """On the average of a period, whatever the limits are; an input without limits never does."""
    period = 1.6
    times = STEP * np.arange(round(20 * AVERAGED / STEP))
    found = rates(np.where(times % period < period / 2, 16.0, -16.0)[:, None])
    last = found[-round(period / STEP) :]
    np.testing.assert_allclose(last[:, :3].mean(0), 2 / period, rtol=0.01)
    assert (found[:, 3] == 0).all()


def test_what_reaches_one_limit_or_none_swings_not():
    times = STEP * np.arange(1000)[:, None]
    middle, half = (HIGH[:3] + LOW[:3]) / 2, (HIGH[:3] - LOW[:3]) / 2
    for share in (0.9 * np.sin(7 * times), np.maximum(1.2 * np.sin(7 * times), -0.5)):
        assert (rates(np.pad(middle + half * share, ((0, 0), (0, 1)))) == 0).all()


def test_swings_are_forgotten():
    inputs = np.concatenate([np.tile([16.0, -16.0], 100), np.zeros(round(2 * AVERAGED / STEP))])[:, None]
    found = rates(inputs)
    assert found[199, 0] > 30
    np.testing.assert_allclose(found[-1, 0], found[199, 0] * np.exp(-2), rtol=0.01)
