"""Loads that do not depend on the motion, and thrusters that fail, against their formulas in NumPy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Load, Pose
from undertow.core.errors import BadInput
from undertow.physics.disturbances import random_suite, sinusoid, table, wrench
from undertow.physics.disturbances.loads import SumOfDisturbances

TIMES = np.array([-1.0, 0.0, 0.7, 1.5, 2.0, 3.9, 4.0, 5.3, 100.0])
CALM = Load(jnp.zeros(2), jnp.zeros(2))
SOMEWHERE = Pose(jnp.zeros(3), jnp.eye(3), jnp.zeros(3))
ROWS = np.array([[0.0, 1.0, -2.0], [1.0, 3.0, 0.5], [4.0, -1.0, 0.5]])
SUITE = random_suite(amplitude=(2.0, 0.5), slowest=0.3, fastest=10.0, step=1.5, hold=2.0, span=8.0, axes=2)


def test_sinusoid_table_and_wrench_are_their_formulas_and_add_up():
    wave = sinusoid((2.0, 0.5), 3.0, offset=(0.1, -0.2), phase=0.4)
    together = SumOfDisturbances((wave, table(ROWS), wrench((5.0, -3.0))))
    found = jax.jit(jax.vmap(lambda t: together.at(((), (), ()), t, None, CALM)))(TIMES)
    waves = [0.1, -0.2] + np.array([2.0, 0.5]) * np.sin(3.0 * TIMES[:, None] + 0.4)
    rows = np.stack([np.interp(TIMES, ROWS[:, 0], ROWS[:, axis]) for axis in (1, 2)], axis=1)
    np.testing.assert_allclose(found.acceleration, waves + rows, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(found.wrench, np.tile([5.0, -3.0], (TIMES.size, 1)))


@functools.cache
def draws():
    """2000 realizations of the suite."""
    draw = jax.jit(lambda key: jax.lax.map(SUITE.realize, jax.random.split(key, 2000)))
    return jax.tree.map(np.asarray, draw(jax.random.PRNGKey(4)))


def test_random_suite_is_three_sinusoids_and_a_level():
    """sqrt(2/3) sin each, so that their rms is the amplitude; the levels change every 2 s, the last of five stays."""
    rates, phases, levels = drawn = jax.tree.map(lambda leaf: leaf[3], draws())
    values = jax.jit(jax.vmap(lambda drawn, t: SUITE.at(drawn, t, None, CALM).acceleration, (None, 0)))
    found = values(drawn, TIMES)
    assert levels.shape == (5, 2)
    swing = np.sqrt(2 / 3) * np.sin(rates * TIMES[:, None, None] + phases).sum(-1)
    index = np.clip(np.floor(TIMES / 2), 0, 4).astype(int)
    np.testing.assert_allclose(found, [2.0, 0.5] * swing + levels[index], rtol=0, atol=1e-13)
    assert SUITE.jumps(5.0) == (2.0, 4.0) and SUITE.jumps(100.0) == (2.0, 4.0, 6.0, 8.0)


def test_random_suite_has_its_distributions():
    """Logarithms of frequencies and phases uniform in their ranges, levels normal: mean and spread of 2000 draws."""
    rates, phases, levels = draws()
    assert rates.min() >= 0.3 and rates.max() <= 10.0 and phases.min() >= 0 and phases.max() <= 2 * np.pi
    for values, low, high in ((np.log(rates), np.log(0.3), np.log(10.0)), (phases, 0.0, 2 * np.pi)):
        np.testing.assert_allclose(values.mean(), (low + high) / 2, atol=0.02 * (high - low))
        np.testing.assert_allclose(values.std(), (high - low) / np.sqrt(12), rtol=0.02)
    np.testing.assert_allclose([levels.mean(), levels.std()], [0.0, 1.5], atol=0.04)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: table([[0.0, 1.0]]), "samples"),
        (lambda: table([[0.0], [1.0]]), "samples"),
        (lambda: table([[0.0, 1.0], [0.0, 2.0]]), "samples"),
        (lambda: table([[0.0, 1.0], [1.0, np.nan]]), "samples"),
        (lambda: table([[0.0, 1.0], [1.0, 2.0]]).at((), jnp.asarray(0.5), None, CALM), "samples"),
        (lambda: wrench((1.0, np.inf)), "value"),
        (lambda: wrench((1.0, 2.0, 3.0)).at((), jnp.asarray(0.0), None, CALM), "value"),
        (lambda: random_suite(slowest=2.0, fastest=1.0), "fastest"),
        (lambda: random_suite(slowest=0.0), "slowest"),
        (lambda: random_suite(amplitude=-1.0), "amplitude"),
        (lambda: random_suite(hold=0.0), "hold"),
        (lambda: random_suite(span=0.0), "span"),
        (lambda: random_suite(axes=0), "axes"),
        (lambda: random_suite(axes=3).at(None, jnp.asarray(0.0), None, CALM), "axes"),
    ],
)
def test_bad_input(make, name):
    with pytest.raises(BadInput, match=rf"`{name}(\[.*\])?` must "):
        make()


def test_limits_that_are_allowed():
    assert random_suite(slowest=1.0, fastest=1.0, axes=1).axes == 1
