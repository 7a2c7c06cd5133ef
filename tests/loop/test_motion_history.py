"""The past that a navigation filter compares late readings with: interpolation, and what each step adds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.navigation.motion_history import MotionHistory, resting

REST = np.array([1.0, 0.0, 0.0, 0.0])
SLOTS = len(resting(jnp.asarray(REST)).age)
AGES = 0.1 * np.arange(1.0, SLOTS + 1) ** 1.2
SQUARE, CUBE = np.array([0.5, -1.0, 2.0]), np.array([-0.3, 0.4, 0.2])


def turned(angle):
    return np.stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)], -1)


def displacement(age):
    return np.multiply.outer(age**2, SQUARE) + np.multiply.outer(age**3, CUBE)


def velocity(age):
    """The displacement falls with age at the rate of the velocity."""
    return -np.multiply.outer(2 * age, SQUARE) - np.multiply.outer(3 * age**2, CUBE)


HISTORY = MotionHistory(
    *map(jnp.asarray, (AGES, displacement(AGES), velocity(AGES), turned(-0.2 * AGES))), jnp.asarray(REST)
)


@pytest.mark.parametrize("age", [0.0, 0.04, AGES[0], 0.13, (AGES[2] + AGES[3]) / 2, AGES[-1] - 1e-9])
def test_a_motion_of_third_order_is_interpolated_exactly(age):
    past = jax.jit(HISTORY.at)(age)
    np.testing.assert_allclose(past[0], displacement(age), atol=1e-12)
    np.testing.assert_allclose(past[1], velocity(age), atol=1e-12)
    np.testing.assert_allclose(past[2], turned(np.asarray(-0.2 * age)), atol=1e-4)  # chords of the arc
    assert np.linalg.norm(past[2]) == pytest.approx(1.0, abs=1e-15)


def test_before_the_oldest_instant_that_one_counts():
    past = HISTORY.at(AGES[-1] + 1.0)
    for found, kept in zip(past, (HISTORY.displacement, HISTORY.velocity, HISTORY.attitudes), strict=True):
        np.testing.assert_allclose(found, kept[-1], rtol=1e-15)


def test_a_step_makes_everything_older_and_lets_it_fall_behind():
    """A constant acceleration from rest: t ago the vehicle was a t^2 / 2 ahead of where its present velocity leads from."""
    acceleration, step = np.array([0.4, -0.2, 0.1]), 0.02
    history = resting(jnp.asarray(REST))
    advance = jax.jit(lambda one: one.after(step, jnp.asarray(acceleration), jnp.asarray(REST), 0.1))
    for _ in range(40):
        history = advance(history)
    kept = np.asarray(history.age) <= 0.8
    ages = np.asarray(history.age)[kept]
    assert kept.sum() > 3 and (np.diff(ages) == pytest.approx(0.1, abs=0.021))
    np.testing.assert_allclose(np.asarray(history.velocity)[kept], np.outer(-ages, acceleration), atol=1e-14)
    np.testing.assert_allclose(np.asarray(history.displacement)[kept], np.outer(ages**2 / 2, acceleration), atol=1e-14)
