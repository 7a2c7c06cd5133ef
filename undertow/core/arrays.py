"""Arrays that are made once: what is the same in a thousand parts is one array, and made for the first of them only."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.runtime import double_outside_runs

_MOST_BYTES = 4096  # of an array; larger ones seldom come twice
_MOST = 4096  # arrays that are remembered


@double_outside_runs
def as_array(value: Any) -> Any:
    """JAX's array of a number, or of nested lists of them: one array for the same numbers, as none ever changes."""
    if isinstance(value, jax.Array):
        return value
    if not isinstance(value, np.ndarray) and any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value)):
        return jnp.asarray(value, dtype=float)
    values = np.asarray(value, dtype=float)  # by numpy, as JAX would compile something
    if values.nbytes > _MOST_BYTES:
        return jnp.asarray(values)
    # What else decides about the array; the device may be of this thread only.
    settings = (jax.config.jax_enable_x64, jax.config.jax_default_device)  # pyright: ignore[reportAttributeAccessIssue]
    return _made(values.tobytes(), values.shape, settings)


@functools.lru_cache(_MOST)
def _made(content: bytes, shape: tuple[int, ...], settings: tuple[Any, ...]) -> jax.Array:
    with jax.ensure_compile_time_eval():  # or what is made while JAX traces would be of that trace only
        return jnp.asarray(np.frombuffer(content).reshape(shape))


def in_present_precision(tree: Any) -> Any:
    """The same tree of parts with its numbers in the precision that JAX computes in now."""

    def converted(leaf: Any) -> Any:
        if not isinstance(leaf, jax.Array) or not jnp.issubdtype(leaf.dtype, jnp.floating):
            return leaf
        present = jax.dtypes.canonicalize_dtype(float)
        return leaf if leaf.dtype == present else as_array(np.asarray(leaf))

    return jax.tree.map(converted, tree)
