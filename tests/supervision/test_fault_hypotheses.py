"""What one and two thrusters explain of a residual, against closed forms."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np

from undertow.supervision.fault_hypotheses import Bounds, missing_effect, one_thruster, two_thrusters, weighed

CHANCE = np.random.default_rng(5)
EFFECT = jnp.asarray(CHANCE.normal(size=(6, 5)))
ROOT = CHANCE.normal(size=(6, 6))
COVARIANCE = jnp.asarray(ROOT @ ROOT.T / 6 + np.eye(6)) * 1e-3
FORCES = jnp.asarray([3.0, -4.0, 5.0, 2.5, -3.5])
LARGEST, USED = 10.0 * jnp.ones(5), jnp.ones(5)
BOUNDS = Bounds(*(jnp.asarray(value) for value in (36.0, 64.0, 12.0, 0.8, 0.08)))


def test_the_ratio_of_a_missing_effect_is_a_difference_of_squared_distances():
    residual, changes = jnp.asarray(CHANCE.normal(size=6)), jnp.asarray(CHANCE.normal(size=5))
    ratios = missing_effect(weighed(EFFECT, COVARIANCE, residual), changes)
    inverse = np.linalg.inv(np.asarray(COVARIANCE))
    distance = lambda value: value @ inverse @ value
    for i, j in itertools.product(range(5), repeat=2):
        off = jnp.asarray(np.isin(np.arange(5), (i, j)).astype(float))
        effect = EFFECT @ (off * changes)
        expected = distance(residual) - distance(residual + effect)
        np.testing.assert_allclose(ratios[i, j], expected, rtol=1e-8)


def explaining(failed, share=0.7):
    """What one and two thrusters explain of the residual of failed ones, of whose force a share is missing."""
    off = jnp.asarray(np.isin(np.arange(5), failed).astype(float))
    seen = weighed(EFFECT, COVARIANCE, -EFFECT @ (share * off * FORCES))
    found, explained = one_thruster(seen, FORCES, LARGEST, USED, BOUNDS)
    return found, two_thrusters(seen, FORCES, LARGEST, USED, BOUNDS, explained), explained, seen.total


def test_one_thruster_explains_its_own_residual_and_no_pair_does_better():
    for i in range(5):
        found, both, explained, total = explaining((i,))
        np.testing.assert_array_equal(found, np.arange(5) == i)
        np.testing.assert_allclose(explained, total, rtol=1e-9)
        assert not both.any()


def test_every_pair_is_found_and_no_other_thruster_is_taken_for_it():
    for pair in itertools.combinations(range(5), 2):
        found, both, explained, total = explaining(pair)
        np.testing.assert_array_equal(both, np.isin(np.arange(5), pair))
        assert found.sum() <= found @ both and explained < 0.999 * total  # if one, then the one that does most of it


def test_a_force_that_no_fault_has_is_not_a_fault():
    found, both, *_ = jax.tree.map(np.asarray, explaining((2,), share=-0.7))
    assert not found.any() and not both.any()
