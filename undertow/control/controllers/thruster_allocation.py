"""Control allocation: forces within limits that give as much as possible of a desired acceleration."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.law_signals import share_given
from undertow.core.actuator_model import Forces
from undertow.core.numerics.box_quadratic import box_minimum
from undertow.core.numerics.linear_algebra import matvec

# Cost of a force at its limit, relative to the loss of all of the desired acceleration.
_USE = 1e-6


def allocate(
    effect: Float[Array, "n m"], forces: Float[Array, " m"], low: Forces, high: Forces, direction: Float[Array, ""]
) -> Float[Array, " m"]:
    """Forces within [low, high] that give as much as possible of the desired acceleration a = effect forces.

    Desired forces within limits are returned unchanged. Else a quadratic programme in the forces and a scale s is
    solved exactly: min direction |effect f - s a|^2 / |a|^2 + (1 - s)^2 + little |f|^2. Section X10 of the theory.
    Redundant actuators replace each other before acceleration is lost.

    Args:
        effect: acceleration per force.
        forces: smallest ones that give the desired acceleration, without limits.
        low, high: limits, one per force or one that holds for each.
        direction: cost of a departure from the direction of a relative to a loss of size; up to 1e6, which keeps it.
    """
    fits = ((forces >= low) & (forces <= high)).all()
    solve = lambda: _programme(effect, forces, low, high, direction)
    return jax.lax.cond(fits, lambda: forces, solve)


def attained(effect: Float[Array, "n m"], desired: Float[Array, " m"], forces: Float[Array, " m"]) -> Float[Array, ""]:
    """Share of the acceleration of the desired forces that other forces give, along its direction; at most 1."""
    return share_given(matvec(effect, desired), matvec(effect, forces))


def _programme(effect, forces, low, high, direction) -> Float[Array, " m"]:
    unit = jnp.maximum(jnp.abs(low), jnp.abs(high))
    unit = jnp.where(jnp.isfinite(unit) & (unit > 0), unit, 1.0)
    desired = matvec(effect, forces)
    size = jnp.sqrt((desired**2).sum())
    size = jnp.where(size > 0, size, 1.0)
    scaled = effect * (unit if unit.ndim == 0 else unit[None, :])
    # Weight and departure in one factor, so that the programme's matrix is a diagonal one and its square.
    factor = jnp.sqrt(direction) * jnp.concatenate([scaled, -desired[:, None]], axis=1) / size
    m = forces.shape[0]
    use = jnp.full(m + 1, _USE).at[m].set(1.0)
    linear = jnp.zeros(m + 1).at[m].set(1.0)
    lower = jnp.concatenate([jnp.broadcast_to(low, (m,)) / unit, jnp.zeros(1)])
    upper = jnp.concatenate([jnp.broadcast_to(high, (m,)) / unit, jnp.ones(1)])
    solution = box_minimum(use, factor, linear, lower, upper)
    return unit * solution[:m]
