"""Sequences of plausible readings: sums and mean sizes of innovations against their closed forms."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.supervision.innovations import InnovationMonitor, JumpLimits
from undertow.control.supervision.motion import MonitoredMotion
from undertow.core.errors import BadInput

DT, LIMITS = 0.02, JumpLimits(1.0, 0.5, 1.0, 1.0)
LEVEL, REST = np.array([1.0, 0, 0, 0]), np.zeros(6)
EXPECTED = MonitoredMotion(np.zeros(3), LEVEL, REST)


@functools.cache
def monitor():
    return InnovationMonitor()


@jax.jit
def after(state, accepted, believe):
    return monitor().after(state, accepted, EXPECTED, LIMITS, believe, jnp.asarray(DT))


def found(steps: int, accepted, believe=False):
    """Contradiction and noise after so many measurements; `accepted(k)` gives each beside a vehicle at rest."""
    state = monitor().init(EXPECTED)
    for k in range(steps):
        state = after(state, accepted(k), np.asarray(believe))
    return float(monitor().contradiction(state)), float(monitor().noise_ratio(state))


def position(north):
    return EXPECTED._replace(position=np.array([north, 0.0, 0.0]))


def surge(speed):
    return EXPECTED._replace(velocity=np.array([speed, 0.0, 0, 0, 0, 0]))


def yawed(angle):
    return EXPECTED._replace(attitude=np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)]))


def test_a_position_that_its_velocity_does_not_explain_adds_up():
    kept = 1 - DT / 2.0
    for steps in (1, 7, 60):
        expected = min(0.02 * (1 - kept**steps) / (1 - kept), 2.0)
        assert found(steps, lambda k: position(0.02))[0] == pytest.approx(expected)
    assert found(400, lambda k: position(0.02))[0] == pytest.approx(2.0 * (1 - kept**400) * 0.5 / 0.5, rel=1e-3)
    assert found(2, lambda k: position(0.9))[0] > 1


def test_a_turn_that_the_angular_velocity_does_not_explain_adds_up():
    one = found(1, lambda k: yawed(0.45))[0]
    assert one == pytest.approx(2 * np.sin(0.225) / 0.5)
    assert found(2, lambda k: yawed(0.45))[0] == pytest.approx(one * (2 - DT / 2))


def test_noise_is_the_mean_size_and_adds_up_to_nothing():
    contradiction, noise = found(50, lambda k: position(0.3 * (-1) ** k))
    assert contradiction < 0.31
    assert noise == pytest.approx(0.3 * (1 - (1 - DT) ** 50) / 0.1)


def test_an_acceleration_that_the_model_does_not_know_is_no_noise():
    assert found(300, lambda k: surge(0.2))[1] < 0.01
    alternating = found(300, lambda k: surge(0.2 * (-1) ** k))[1]
    assert alternating == pytest.approx(2.0, rel=0.02)


def test_a_jump_that_is_taken_as_the_truth_is_no_innovation():
    assert found(5, lambda k: position(40.0), believe=True) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert found(1, lambda k: position(40.0))[0] == 2.0


@pytest.mark.parametrize("name", ["memory", "averaged", "noise"])
def test_numbers_have_to_be_positive(name):
    with pytest.raises(BadInput, match=name):
        InnovationMonitor(**{name: 0.0})
