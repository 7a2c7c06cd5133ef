"""What one and two thrusters explain of a residual, against closed forms."""

import itertools

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from undertow.control.supervision.fault_hypotheses import FaultThresholds, missing_effect, one_thruster, two_thrusters
from undertow.control.supervision.fault_onset import ONSETS, Wide, cleared, examine, onset_state, transients, weighed

CHANCE = np.random.default_rng(5)
EFFECT = CHANCE.normal(size=(6, 5))
ROOT = CHANCE.normal(size=(6, 6))
COVARIANCE = (ROOT @ ROOT.T / 6 + np.eye(6)) * 1e-3
FORCES = np.array([3.0, -4.0, 5.0, 2.5, -3.5])
USED = np.ones(5)
BOUNDS = FaultThresholds(np.asarray(25.0), np.asarray(12.0), 0.8 * np.ones(5))
BANDWIDTH, DECAY, ELAPSED = 15.0, 0.06, 0.05  # rad/s, s, s

remaining = jax.jit(transients)
explained_by_one = jax.jit(one_thruster)


@jax.jit
def ratios_of(residual, changes):
    return missing_effect(weighed(EFFECT, COVARIANCE, residual), changes)


def test_the_ratio_of_a_missing_effect_is_a_difference_of_squared_distances():
    residual, changes = CHANCE.normal(size=6), CHANCE.normal(size=5)
    ratios = np.asarray(ratios_of(residual, changes))
    inverse = np.linalg.inv(COVARIANCE)
    distance = lambda value: value @ inverse @ value
    for i, j in itertools.product(range(5), repeat=2):
        effect = EFFECT @ (np.isin(np.arange(5), (i, j)) * changes)
        expected = distance(residual) - distance(residual + effect)
        np.testing.assert_allclose(ratios[i, j], expected, rtol=1e-8)


@jax.jit
def pair_of(difference):
    wide = Wide(weighed(EFFECT, COVARIANCE, difference), FORCES)
    return two_thrusters(wide, FORCES, USED, BOUNDS)


def pair_in(failed, share=0.7):
    """Which pair is found in a wide difference of failed thrusters, of whose force a share is missing."""
    return np.asarray(pair_of(-EFFECT @ (share * np.isin(np.arange(5), failed) * FORCES)))


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
    found = np.asarray(remaining(BANDWIDTH, decay, ELAPSED))
    for column, start in enumerate(np.eye(3)[::-1]):  # behind two, one and no low-pass
        exact = solve_ivp(rate, (0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-12).y[2]
        np.testing.assert_allclose(found[:, column], exact, atol=3e-3 if decay != DECAY else 1e-8)


COUNT, ONSET, FAILING = 27, 20, 2  # examinations, the one at which a fault begins, and its thruster


@jax.jit
def followed(residuals, forces, remains):
    """State and missing forces after an examination of each residual."""

    def step(state, instant):
        k, residual, of_now = instant
        state, missing = examine(state, residual, of_now, EFFECT, np.zeros(5), remains, np.asarray(0.0))
        return cleared(state, k == ONSET), missing  # what was before the history was full

    start = onset_state(6, 5)._replace(covariance=COVARIANCE)
    state, missing = jax.lax.scan(step, start, (np.arange(1, COUNT + 1), residuals, forces))
    return state, missing[-1]


def behind_low_passes(series, fine):
    """At each examination, the series of so many steps between them behind two low-passes and behind one."""
    keep = np.exp(-BANDWIDTH * ELAPSED / fine)
    ago = fine * np.arange(1, COUNT + 1)[:, None] - np.arange(1, COUNT * fine + 1)
    one = np.where(ago >= 0, (1 - keep) * keep**ago, 0.0)
    two = np.where(ago >= 1, (1 - keep) ** 2 * ago * keep ** (ago - 1), 0.0)
    return two @ series, one @ series


def examined(share, pushed=0.0):
    """State and missing forces after examinations of a healthy model of which one thruster fails at the onset.

    Nominal forces vary; of the failing one the share is missing, but for what the onset leaves and decays.
    """
    fine = 200
    force = lambda t: 2 * FORCES * (1 + 0.2 * np.sin(3.0 * t[..., None] + np.arange(5.0)))
    times, begin = ELAPSED / fine * np.arange(1, COUNT * fine + 1), np.asarray(ONSET * ELAPSED)
    since, forces = times - begin, force(times)
    kept = force(begin)[FAILING] * np.exp(-np.maximum(since, 0.0) / DECAY)
    lost = np.where(since > 0, share * (forces[:, FAILING] - kept), 0.0)
    two, one = behind_low_passes(np.column_stack([forces, lost]), fine)
    pushed = np.where(np.arange(1, COUNT + 1) > ONSET, 1.0, 0.0)[:, None] * pushed
    residuals = -two[:, 5:] * EFFECT[:, FAILING] + pushed
    of_examinations = np.stack([two[:, :5], one[:, :5], forces[fine - 1 :: fine]], axis=1)
    return jax.tree.map(np.asarray, followed(residuals, of_examinations, remaining(BANDWIDTH, DECAY, ELAPSED)))


@pytest.mark.parametrize("share", [1.0, 0.5, 2.0])
def test_the_missing_share_and_all_of_the_square_are_that_of_the_thruster_since_its_onset(share):
    state, missing = examined(share)
    lag = COUNT - ONSET - 1  # the onset was seven examinations ago
    np.testing.assert_allclose(state.along[lag, FAILING] / state.size[lag, FAILING], share, rtol=0.03)
    explained = state.along[lag, FAILING] ** 2 / state.size[lag, FAILING]
    np.testing.assert_allclose(explained, state.total[lag], rtol=0.02)
    found, square = explained_by_one(state, missing, USED, BOUNDS)
    np.testing.assert_array_equal(found, np.arange(5) == FAILING)
    np.testing.assert_allclose(square, explained, rtol=0.05)  # rest and noise of two ways to count


def test_a_force_that_grew_a_load_and_an_unused_thruster_are_no_fault():
    state, missing = examined(-0.7)
    assert not explained_by_one(state, missing, USED, BOUNDS)[0].any()
    away = np.linalg.svd(EFFECT)[0][:, 5] * 30.0  # what no thruster can give
    state, missing = examined(0.0, pushed=away)
    assert not explained_by_one(state, missing, USED, BOUNDS)[0].any()
    state, missing = examined(1.0)
    assert not explained_by_one(state, missing, np.where(np.arange(5) == FAILING, 0.0, USED), BOUNDS)[0][FAILING]


def test_what_remains_unexplained_counts_as_noise():
    quiet, missing = examined(1.0)
    _, square = explained_by_one(quiet, missing, USED, BOUNDS)
    restless = quiet._replace(total=quiet.total + 10 * 6 * np.arange(1.0, ONSETS + 1))
    _, less = explained_by_one(restless, missing, USED, BOUNDS)
    assert less < square / 15  # ten times the expected square, counted twice
