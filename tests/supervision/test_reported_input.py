"""Whether a reported input moves the plant, on a plant with one axis of which everything is known."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.supervision.reported_input import ReportedInput
from undertow.core.errors import BadInput
from undertow.physics.plants.double_integrator import DoubleIntegrator

T, LIMIT = 0.02, 20.0


@functools.cache
def parts():
    model = DoubleIntegrator(LIMIT, outputs=("x",), output_units=("m",)).model()
    return model, ReportedInput(np.array([LIMIT]), np.array([2 * LIMIT]))


@jax.jit
def _after(state, velocity, reported, command):
    model, test = parts()
    y = model.coordinates.measurement(jnp.zeros(1), velocity)
    state = test.after(state, model, y, reported, command, jnp.asarray(T))
    return state, test.contradicted(state)


def contradicted(command, reported, applied, mass=1.0, load=0.0, noise=0.0, seconds=2.0) -> float:
    """The largest ratio of a run in which the plant gets what is applied, with another mass and a load.

    Before, reported and commanded input are zero.
    """
    model, test = parts()
    velocity, largest, chance = np.zeros(1), 0.0, np.random.default_rng(0)
    state = test.init(model, model.coordinates.measurement(jnp.zeros(1), jnp.asarray(velocity)), jnp.zeros(1))
    for k in range(round(seconds / T)):
        read = velocity + noise * chance.normal(size=1)
        inputs = (np.atleast_1d(np.asarray(of(k * T), dtype=float)) for of in (reported, command))
        state, ratio = _after(state, read, *inputs)
        largest = max(largest, float(ratio))
        velocity = velocity + T * (applied(k * T) / mass + load)
    return largest


sine = lambda t: 12.0 * np.sin(3.0 * t)
limited = lambda t: np.clip(sine(t), -4.0, 4.0)


def test_what_is_applied_as_commanded_is_never_contradicted():
    assert contradicted(sine, sine, sine, mass=1.5, load=3.0, noise=0.1) == 0.0


def test_a_true_report_of_another_input_is_believed():
    assert contradicted(sine, limited, limited) < 0.5  # what the sine does beyond the limit is not followed
    assert contradicted(sine, limited, limited, mass=1.3, load=0.5, noise=0.05) < 0.5
    assert contradicted(sine, lambda t: 0.0 * t, lambda t: 0.0 * t, noise=0.05) < 0.01


@pytest.mark.parametrize("reported", [lambda t: 20.0, lambda t: -20.0, lambda t: 0.0, lambda t: -sine(t)])
def test_a_report_that_the_motion_contradicts_is_found(reported):
    assert contradicted(sine, reported, sine, mass=1.3, load=0.5, noise=0.05) > 1.0


def test_a_wrong_report_is_found_within_half_a_second():
    assert contradicted(sine, lambda t: -20.0, sine, seconds=0.5) > 1.0


@functools.cache
def of_changes_alone():
    """A test of a plant with unlimited authority, of which the motion says nothing."""
    return ReportedInput(np.array([np.inf]), np.array([2 * LIMIT]))


def unfollowed(pairs) -> list[float]:
    """Ratios of the test of changes alone, along pairs of reported and commanded input."""
    model, test, ratios = parts()[0], of_changes_alone(), []
    y = model.coordinates.measurement(jnp.zeros(1), jnp.zeros(1))
    state = test.init(model, y, jnp.zeros(1))
    for reported, command in pairs:
        state = test.after(state, model, y, jnp.full(1, reported), jnp.full(1, command), jnp.asarray(T))
        ratios.append(float(test.contradicted(state)))
    return ratios


def test_changes_that_a_report_does_not_follow_add_up():
    swings = [10.0, -10.0, 10.0]  # of a range of 40
    np.testing.assert_allclose(unfollowed([(2.0, u) for u in swings]), [0.25 - 4 * 0.05, 0.55, 1.05], atol=1e-12)
    constant = unfollowed([(2.0, 10.0)] * 50)
    assert constant[0] == constant[-1]


def test_a_report_that_follows_late_or_in_part_is_believed():
    swings = [10.0, -10.0] * 10
    late = zip([0.0, *swings], [*swings, 10.0], strict=True)
    assert max(unfollowed(late)) <= 0.5
    assert max(unfollowed([(0.3 * u, u) for u in swings])) == 0.0


def test_a_report_of_no_input_is_not_one_that_stands_still():
    """As of a vehicle that is disarmed."""
    assert max(unfollowed([(0.1, u) for u in [10.0, -10.0] * 10])) == 0.0


def test_a_report_that_follows_again_is_believed_again():
    ratios = unfollowed([(2.0, u) for u in [10.0, -10.0] * 10] + [(u, u) for u in [10.0, -10.0] * 2])
    assert ratios[19] == 2.0 and ratios[-1] < 1.0


def test_numbers_have_to_be_positive():
    with pytest.raises(BadInput, match="threshold"):
        ReportedInput(np.ones(1), np.ones(1), threshold=0.0)
