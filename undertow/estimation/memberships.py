"""Normalised Gaussian memberships: a softmax, and a quicker way to it for evenly spaced sets."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Largest exponent that the quick way may meet inside the grid; exp overflows at 709.
_LARGEST_EXPONENT = 600.0


def memberships(x: Float[Array, "*n"], centres: Float[Array, " M"], widths: Float[Array, " M"]) -> Float[Array, "*n M"]:
    """exp(-((x - c_l) / sigma_l)^2) / sum of the same; finite however far x lies from every set."""
    return jax.nn.softmax(-(((x[..., None] - centres) / widths) ** 2), axis=-1)


def even_memberships(
    x: Float[Array, "*n"], centres: Float[Array, " M"], widths: Float[Array, " M"]
) -> Float[Array, "*n M"]:
    """Same for equal spacing h and width sigma, with one exponential instead of M.

    Relative to the outermost set on the side of x, the set j steps further in weighs
    r^j exp(-(j h / sigma)^2) with r = exp(-2 h (distance beyond the outermost centre) / sigma^2).
    """
    count = centres.shape[0]
    middle, half = (centres[0] + centres[-1]) / 2, (centres[-1] - centres[0]) / 2
    spacing, width = 2 * half / (count - 1), widths[0]
    offset = x - middle
    ratio = jnp.exp(-2 * spacing * (jnp.abs(offset) - half) / width**2)
    inward = jnp.exp(-((jnp.arange(count, dtype=float) * spacing / width) ** 2))
    powers = [jnp.ones_like(ratio)]
    for _ in range(1, count):
        powers.append(powers[-1] * ratio)
    weights = jnp.stack(powers, -1) * inward
    weights = weights / weights.sum(-1, keepdims=True)
    return jnp.where((offset >= 0)[..., None], weights[..., ::-1], weights)


def is_even(centres: np.ndarray, widths: np.ndarray) -> bool:
    """Whether `even_memberships` applies: equal spacing and widths, and no overflow inside the grid."""
    count = len(centres)
    if count < 2 or np.any(np.diff(centres) <= 0):
        return False
    steps = np.diff(centres)
    even = np.allclose(steps, steps[0], rtol=1e-12) and np.allclose(widths, widths[0], rtol=1e-12)
    return bool(even and ((count - 1) * steps[0] / widths[0]) ** 2 < _LARGEST_EXPONENT)
