"""The discrete algebraic Riccati equation of small systems with one input."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_DOUBLINGS = 40  # the horizon is 2^40 steps


def regulator_gain(
    transition: Float[Array, "n n"], entry: Float[Array, " n"], weight: Float[Array, "n n"]
) -> Float[Array, " n"]:
    """K of u = -K x that minimises the sum of x^T Q x + u^2 under x[k+1] = A x[k] + b u[k].

    By the structure-preserving doubling algorithm of Chu, Fan, Lin and Wang (2004): it converges quadratically for a
    stabilisable pair with a detectable weight, takes a fixed number of small products, and has gradients.

    Args:
        transition: A.
        entry: b.
        weight: Q, symmetric and positive semidefinite.
    """
    identity = jnp.eye(transition.shape[0])

    def double(_, held):
        a, g, h = held
        between = jnp.linalg.inv(identity + g @ h)
        return a @ between @ a, g + a @ between @ g @ a.T, h + a.T @ h @ between @ a

    start = (transition, jnp.outer(entry, entry), weight)
    _, _, cost = jax.lax.fori_loop(0, _DOUBLINGS, double, start)
    ahead = cost @ entry
    return (ahead @ transition) / (1 + entry @ ahead)
