"""What one and two thrusters explain of a residual, against closed forms."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from undertow.supervision.fault_hypotheses import Bounds, missing_effect, one_thruster, two_thrusters
from undertow.supervision.fault_onset import ONSETS, Seen, cleared, examine, onset_state, transients, weighed

CHANCE = np.random.default_rng(5)
EFFECT = jnp.asarray(CHANCE.normal(size=(6, 5)))
ROOT = CHANCE.normal(size=(6, 6))
COVARIANCE = jnp.asarray(ROOT @ ROOT.T / 6 + np.eye(6)) * 1e-3
FORCES = jnp.asarray([3.0, -4.0, 5.0, 2.5, -3.5])
USED = jnp.ones(5)
BOUNDS = Bounds(jnp.asarray(25.0), jnp.asarray(12.0), 0.8 * jnp.ones(5))
BANDWIDTH, DECAY, ELAPSED = 15.0, 0.06, 0.05  # rad/s, s, s


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


def pair_in(failed, share=0.7):
    """Which pair is found in a wide difference of failed thrusters, of whose force a share is missing."""
    off = jnp.asarray(np.isin(np.arange(5), failed).astype(float))
    seen = weighed(EFFECT, COVARIANCE, -EFFECT @ (share * off * FORCES))
    return np.asarray(two_thrusters(Seen(jnp.zeros((ONSETS, 5)), seen, FORCES), FORCES, USED, BOUNDS))


@pytest.mark.full
def test_every_pair_is_found_and_a_single_thruster_is_no_pair():
    for pair in itertools.combinations(range(5), 2):
        np.testing.assert_array_equal(pair_in(pair), np.isin(np.arange(5), pair))
    for i in range(5):
        assert not pair_in((i,)).any()
    assert not pair_in((1, 2), share=-0.7).any()  # forces that grew


@pytest.mark.parametrize("decay", [DECAY, 1 / BANDWIDTH])
def test_what_remains_of_a_force_solves_its_differential_equations(decay):
    rate = lambda t, x: [-x[0] / decay, BANDWIDTH * (x[0] - x[1]), BANDWIDTH * (x[1] - x[2])]
    times = ELAPSED * np.arange(ONSETS + 1)
    found = np.asarray(transients(BANDWIDTH, decay, ELAPSED))
    for column, start in enumerate(np.eye(3)[::-1]):  # behind two, one and no low-pass
        exact = solve_ivp(rate, (0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-12).y[2]
        np.testing.assert_allclose(found[:, column], exact, atol=3e-3 if decay != DECAY else 1e-8)


@jax.jit
def step(state, residual, forces, remains):
    return examine(state, residual, forces, EFFECT, jnp.zeros(5), remains, jnp.asarray(0.0))


def examined(share, onset=20, count=27, failing=2, noise=0.0, pushed=None):
    """State and findings after examinations of a healthy thruster model of which one thruster fails at the onset.

    Nominal forces vary; of the failing one the share is missing, but for what the onset leaves and decays.
    """
    fine = 200
    h = ELAPSED / fine
    chance, remains = np.random.default_rng(3), transients(BANDWIDTH, DECAY, ELAPSED)
    state = onset_state(6, 5)._replace(covariance=COVARIANCE)
    one, two, lost_one, lost_two = np.zeros(5), np.zeros(5), 0.0, 0.0
    keep, seen = np.exp(-BANDWIDTH * h), None
    force = lambda t: 2 * np.asarray(FORCES) * (1 + 0.2 * np.sin(3.0 * t + np.arange(5.0)))
    for k in range(1, count + 1):
        for i in range(fine):
            t = ((k - 1) * fine + i + 1) * h
            since = t - onset * ELAPSED
            f = force(t)
            kept = force(onset * ELAPSED)[failing] * np.exp(-max(since, 0.0) / DECAY)
            lost = share * (f[failing] - kept) if since > 0 else 0.0
            two, lost_two = one + (two - one) * keep, lost_one + (lost_two - lost_one) * keep
            one, lost_one = f + (one - f) * keep, lost + (lost_one - lost) * keep
        residual = -np.asarray(EFFECT)[:, failing] * lost_two + noise * chance.normal(size=6)
        if pushed is not None and k > onset:
            residual = residual + pushed
        state, seen = step(state, residual, np.stack([two, one, force(k * ELAPSED)]), remains)
        if k == onset:
            state = cleared(state, jnp.asarray(True))  # what was before the history was full
    return state, seen


@pytest.mark.parametrize("share", [1.0, 0.5, 2.0])
def test_the_missing_share_and_all_of_the_square_are_that_of_the_thruster_since_its_onset(share):
    state, seen = examined(share)
    lag = 27 - 20 - 1  # the onset was seven examinations ago
    np.testing.assert_allclose(state.along[lag, 2] / state.size[lag, 2], share, rtol=0.03)
    explained = state.along[lag, 2] ** 2 / state.size[lag, 2]
    np.testing.assert_allclose(explained, state.total[lag], rtol=0.02)
    found, square = one_thruster(state, seen, USED, BOUNDS)
    np.testing.assert_array_equal(found, np.arange(5) == 2)
    np.testing.assert_allclose(square, explained, rtol=0.05)  # rest and noise of two ways to count


def test_a_force_that_grew_a_load_and_an_unused_thruster_are_no_fault():
    state, seen = examined(-0.7)
    assert not one_thruster(state, seen, USED, BOUNDS)[0].any()
    away = np.linalg.svd(np.asarray(EFFECT))[0][:, 5] * 30.0  # what no thruster can give
    state, seen = examined(0.0, pushed=away)
    assert not one_thruster(state, seen, USED, BOUNDS)[0].any()
    state, seen = examined(1.0)
    assert not one_thruster(state, seen, USED.at[2].set(0.0), BOUNDS)[0][2]


def test_what_remains_unexplained_counts_as_noise():
    quiet, seen = examined(1.0)
    _, square = one_thruster(quiet, seen, USED, BOUNDS)
    restless = quiet._replace(total=quiet.total + 10 * 6 * jnp.arange(1.0, ONSETS + 1))
    _, less = one_thruster(restless, seen, USED, BOUNDS)
    assert less < square / 15  # ten times the expected square, counted twice
