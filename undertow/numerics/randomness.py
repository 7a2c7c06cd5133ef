"""Random keys by number: whatever is new at every sample takes its key from the number of the sample."""

import jax
from jaxtyping import Array, Int, PRNGKeyArray


def numbered(key: PRNGKeyArray, number: Int[Array, ""]) -> PRNGKeyArray:
    """Another key for every whole number, negative ones included: all bits of it count, where JAX takes the last 32."""
    if number.dtype.itemsize == 4:
        return jax.random.fold_in(key, number)
    high, low = number >> 32, number & 0xFFFFFFFF
    return jax.random.fold_in(jax.random.fold_in(key, high), low)
