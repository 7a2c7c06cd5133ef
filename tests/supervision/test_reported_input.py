"""Whether a reported input moves the plant, on a plant with one axis of which everything is known."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.plants.double_integrator import DoubleIntegrator
from undertow.supervision.reported_input import ReportedInput

T, LIMIT = 0.02, 20.0


@functools.cache
def parts():
    model = DoubleIntegrator(LIMIT, outputs=("x",), output_units=("m",)).model()
    return model, ReportedInput(np.array([LIMIT]))


@jax.jit
def _after(state, velocity, reported, command):
    model, test = parts()
    y = model.coordinates.measurement(jnp.zeros(1), velocity)
    state = test.after(state, model, y, reported, command, jnp.asarray(T))
    return state, test.contradicted(state)


def contradicted(command, reported, applied, mass=1.0, load=0.0, noise=0.0, seconds=2.0) -> float:
    """The largest ratio of a run in which the plant gets what is applied, with another mass and a load."""
    model, test = parts()
    velocity, largest, chance = np.zeros(1), 0.0, np.random.default_rng(0)
    state = test.init(model, model.coordinates.measurement(jnp.zeros(1), jnp.asarray(velocity)))
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
    assert contradicted(sine, limited, limited) == 0.0
    assert contradicted(sine, limited, limited, mass=1.3, load=0.5, noise=0.05) < 0.5
    assert contradicted(sine, lambda t: 0.0 * t, lambda t: 0.0 * t, noise=0.05) < 0.01


@pytest.mark.parametrize("reported", [lambda t: 20.0, lambda t: -20.0, lambda t: 0.0, lambda t: -sine(t)])
def test_a_report_that_the_motion_contradicts_is_found(reported):
    assert contradicted(sine, reported, sine, mass=1.3, load=0.5, noise=0.05) > 1.0


def test_a_wrong_report_is_found_within_half_a_second():
    assert contradicted(sine, lambda t: -20.0, sine, seconds=0.5) > 1.0


def test_numbers_have_to_be_positive():
    with pytest.raises(BadInput, match="threshold"):
        ReportedInput(np.ones(1), threshold=0.0)
