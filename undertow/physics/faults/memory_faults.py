"""Single numbers of the state of a law, whatever its structure."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, PyTree

from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number


def with_entry(state: PyTree, entry: int | None, when: Bool[Array, ""], new: Callable[[Array], Array]) -> PyTree:
    """The state with one of its real numbers replaced.

    Args:
        state: any tree.
        entry: which number, from 1, in the order of the tree; None for those of the largest magnitude.
        when: whether it is replaced.
        new: numbers -> what they become.

    Raises:
        BadInput: there is no such number.
    """
    leaves, tree = jax.tree.flatten(state)
    real = [jnp.issubdtype(leaf.dtype, jnp.floating) for leaf in leaves]
    count = sum(leaf.size for leaf, floating in zip(leaves, real, strict=True) if floating)
    if not count:
        raise BadInput("target", "have a state with real numbers for this mode", "a controller without any")
    if entry is not None and not 1 <= entry <= count:
        raise BadInput("entry", f"be from 1 to {count}, the numbers of the state of the controller", entry)
    largest = [jnp.abs(leaf).max() for leaf, floating in zip(leaves, real, strict=True) if floating and leaf.size]
    top, first, changed = jnp.stack(largest).max(), 0, []
    for leaf, floating in zip(leaves, real, strict=True):
        if floating:
            place = 1 + first + jnp.arange(leaf.size).reshape(leaf.shape)
            chosen = jnp.abs(leaf) == top if entry is None else place == entry
            first += leaf.size
            leaf = jnp.where(when & chosen, new(leaf), leaf)
        changed.append(leaf)
    return jax.tree.unflatten(tree, changed)


def flipped(numbers: Array, bit: Number) -> Array:
    """Numbers with one bit of each flipped; bit 0 is the sign, bit 1 the largest of the exponent."""
    width = numbers.dtype.itemsize * 8
    whole = jnp.uint64 if width == 64 else jnp.uint32
    place = (width - 1 - jnp.round(bit).astype(int)).astype(whole)
    raw = jax.lax.bitcast_convert_type(numbers, whole)
    return jax.lax.bitcast_convert_type(raw ^ (jnp.ones((), whole) << place), numbers.dtype)
