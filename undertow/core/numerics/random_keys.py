"""Random keys: one for each random quantity, by its name, and one for each sample, by its number.

A key is used once: either to sample from or to make other keys.
"""

import jax
import numpy as np
from jaxtyping import Array, Int, PRNGKeyArray


def key_of_seed(seed: int) -> PRNGKeyArray:
    """The key from which all random numbers of a run follow; `seed` of a scenario, of which 32 bits count."""
    generator = jax.config.jax_default_prng_impl  # pyright: ignore[reportAttributeAccessIssue]
    if generator == "threefry2x32" and isinstance(seed, int) and 0 <= seed < 2**32:
        # What it would compute, without compiling two programs.
        return jax.device_put(np.array([0, seed], np.uint32))
    return jax.random.PRNGKey(seed)


def numbered(key: PRNGKeyArray, number: Int[Array, ""]) -> PRNGKeyArray:
    """A different key for every integer, negative ones included: all bits count, whereas JAX uses the last 32."""
    if number.dtype.itemsize == 4:
        return jax.random.fold_in(key, number)
    high, low = number >> 32, number & 0xFFFFFFFF
    return jax.random.fold_in(jax.random.fold_in(key, high), low)


def keys_for(key: PRNGKeyArray, *names: str) -> dict[str, PRNGKeyArray]:
    """A different key for each name. The order of names matters; a name added at the end changes no other key.

    Raises:
        ValueError: a name is given twice.
    """
    if len(set(names)) != len(names):
        raise ValueError(f"Names of random keys must be different, but are: {', '.join(names)}")
    return dict(zip(names, jax.random.split(key, len(names)), strict=True))
