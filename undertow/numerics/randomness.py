"""Random keys: one for each thing that is random, by its name, and one for each sample, by its number.

A key is used once: either to draw from or to make other keys of.
"""

import jax
from jaxtyping import Array, Int, PRNGKeyArray


def numbered(key: PRNGKeyArray, number: Int[Array, ""]) -> PRNGKeyArray:
    """Another key for every whole number, negative ones included: all bits of it count, where JAX takes the last 32."""
    if number.dtype.itemsize == 4:
        return jax.random.fold_in(key, number)
    high, low = number >> 32, number & 0xFFFFFFFF
    return jax.random.fold_in(jax.random.fold_in(key, high), low)


def keys_for(key: PRNGKeyArray, *names: str) -> dict[str, PRNGKeyArray]:
    """A key for each name, all different. Their order counts; a name that is added at the end changes no other key.

    Raises:
        ValueError: a name that is given twice.
    """
    if len(set(names)) != len(names):
        raise ValueError(f"Keys are by name, and these are not all different: {', '.join(names)}")
    return dict(zip(names, jax.random.split(key, len(names)), strict=True))
