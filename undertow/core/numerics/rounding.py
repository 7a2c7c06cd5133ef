"""Numbers of few digits, as people write them."""

import jax.numpy as jnp
from jaxtyping import Array, Float

_POWERS = [float(f"1e{k}") for k in range(23)]  # exact in double precision


def three_digits(values: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """The nearest numbers with three digits, as `float(f"{value:.3g}")` gives them: 0.012345 becomes 0.0123."""
    exponent = jnp.floor(jnp.log10(jnp.abs(jnp.where(values == 0, 1.0, values)))).astype(int) - 2
    powers = jnp.asarray(_POWERS)
    larger, smaller = powers[jnp.clip(exponent, 0, 22)], powers[jnp.clip(-exponent, 0, 22)]
    return jnp.round(values * smaller / larger) * larger / smaller
