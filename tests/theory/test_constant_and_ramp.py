"""I19, I20: the estimate of a constant, of a ramp and of anything of bounded rate; theory.md section 3.4.

One run per invariant; every axis is one signal.
"""

import numpy as np
import pytest

from undertow.analysis import small_signal
from undertow.physics.disturbances.table import table
from undertow.simulation.loop import continuous

pytestmark = pytest.mark.full

RATE = 20.0  # m/s^3
END = 12.0


def test_constant_is_learnt_and_ramp_is_followed_at_a_distance(rails):
    constants, ramps = np.array([1.0, -5.0, 20.0]), np.array([1.0, -3.0])
    rates = np.concatenate([np.zeros(3), ramps])
    starts = np.concatenate([constants, np.zeros(2)])
    rows = np.array([[0.0, *starts], [6.0, *(starts + 6 * rates)]])
    loop = rails(5, disturbance=table(rows))
    outcome = continuous.simulate(loop, duration=5.0, record_step=0.5)
    d_til = np.asarray(outcome.signals["estimate"] - outcome.signals["uncertainty"])[-1]
    assert (np.abs(d_til[:3]) <= 1e-8).all(), d_til
    assert np.abs(d_til[3:] / ramps) == pytest.approx(0.00712, rel=0.02)
    assert np.abs(d_til[3:] / ramps) == pytest.approx(small_signal.ramp_error(loop.controller)[1], rel=1e-3)


def bounded_rate_signals():
    """Triangles: a long ramp, a square wave of rate at the observer's resonance, and rates switched at random."""
    times = np.linspace(0.0, END, 1201)
    steps = np.random.default_rng(7).integers(0, 2, (1200, 8)) * 2.0 - 1.0
    slow = np.repeat(steps[::25], 25, axis=0)  # random, but at most every quarter of a second
    period = round(np.pi / 125 / (times[1])) * 2  # about the observer's damped frequency
    square = np.where(np.arange(1200) % period < period // 2, 1.0, -1.0)[:, None]
    ramp = np.where(np.arange(1200) < 1000, 1.0, -1.0)[:, None]
    rates = RATE * np.concatenate([steps, slow, square, ramp], axis=1)
    values = np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum(rates * times[1], axis=0)])
    return np.concatenate([times[:, None], values], axis=1)


@pytest.mark.slow
def test_errors_stay_below_the_peak_gains(rails):
    rows = bounded_rate_signals()
    assert np.abs(np.diff(rows[:, 1:], axis=0) / np.diff(rows[:, :1], axis=0)).max() <= RATE * (1 + 1e-9)
    loop = rails(rows.shape[1] - 1, disturbance=table(rows))
    outcome = continuous.simulate(loop, duration=END, record_step=2.5e-3, dt=5e-4)
    samples, settled = outcome.signals, np.asarray(outcome.time) > 1.0
    error = np.abs(np.asarray(samples["error"]))[settled]
    d_til = np.abs(np.asarray(samples["estimate"] - samples["uncertainty"]))[settled]
    s = 5 * (samples["error"] - samples["velocity"])[settled]
    assert np.abs(np.asarray(s)).max() < 0.2 * 0.5, "the tanh is in its linear range"
    assert error.max() <= 1.05 * 6.95e-5 * RATE
    assert d_til.max() <= 1.05 * 0.01165 * RATE
    # The bounds are close: a ramp reaches the first, a resonant square wave most of the second.
    assert error.max() >= 0.95 * 6.95e-5 * RATE
    assert d_til.max() >= 0.75 * 0.01165 * RATE
