"""What the actuators of a plant can do: limits of its input, and the acceleration that they give."""

import jax.numpy as jnp
from jaxtyping import PyTree

from undertow.core.actuator_model import force_of
from undertow.core.contracts import AbstractPlant, Inputs, Model, Outputs

BEYOND = 1e9  # more than any actuator takes, in its unit


def limits_of(plant: AbstractPlant, x: PyTree) -> tuple[Inputs, Inputs]:
    """Least and largest input that a plant takes in a state; infinite where there is no limit."""
    beyond = jnp.full(plant.inputs(), BEYOND)
    limits = (plant.admissible(x, sign * beyond) for sign in (-1.0, 1.0))
    low, high = (jnp.where(jnp.abs(limit) < beyond, limit, jnp.inf * jnp.sign(limit)) for limit in limits)
    return low, high


def authority_of(model: Model, plant: AbstractPlant) -> Outputs:
    """Largest acceleration that the actuators can give along each axis of a model, m/s^2 and rad/s^2.

    It is infinite where they have no limit, and zero along an axis in which none of them acts.

    Args:
        model: nominal model.
        plant: at its start, with the limits of its input.
    """
    x = plant.initial_state()
    gain = jnp.abs(model.dynamics.gain(plant.output(jnp.zeros(()), x)))
    forces = jnp.stack([jnp.abs(force_of(model.actuators, limit)) for limit in limits_of(plant, x)]).max(0)
    forces = jnp.where(jnp.isnan(forces), jnp.inf, forces)  # a model of an actuator may be inf - inf without a limit
    return jnp.where(gain > 0, gain * forces[None, :], 0.0).sum(1)
