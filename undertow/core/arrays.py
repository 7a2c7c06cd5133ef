"""Cache of small constant arrays: equal values in many parts share one JAX array."""

import functools
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from undertow.core.runtime import double_outside_runs

_MOST_BYTES = 4096  # of a cached array; larger ones are seldom equal
_MOST = 4096  # cached arrays
_ZERO = np.zeros(())


@double_outside_runs
def as_array(value: Any) -> Any:
    """JAX array of a number or of nested lists of numbers. Equal numbers share one array: arrays are immutable."""
    if isinstance(value, jax.Array):
        return value
    if not isinstance(value, np.ndarray) and any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value)):
        return jnp.asarray(value, dtype=float)
    values = np.asarray(value, dtype=float)  # by NumPy, because JAX would compile a program
    if values.nbytes > _MOST_BYTES:
        with jax.ensure_compile_time_eval():
            return jax.device_put(values)
    # The settings that the array depends on, too; the device may be set for this thread only.
    settings = (jax.config.jax_enable_x64, jax.config.jax_default_device)  # pyright: ignore[reportAttributeAccessIssue]
    return _made(values.tobytes(), values.shape, settings)


@functools.lru_cache(_MOST)
def _made(content: bytes, shape: tuple[int, ...], settings: tuple[Any, ...]) -> jax.Array:
    with jax.ensure_compile_time_eval():  # an array made during tracing would belong to that trace
        return jax.device_put(np.frombuffer(content).reshape(shape))  # `asarray` would compile a program for each shape


def with_arrays(tree: Any) -> Any:
    """The tree with arrays of JAX for those of NumPy."""
    if not any(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves(tree)):
        return tree
    return jax.tree.map(lambda leaf: as_array(leaf) if isinstance(leaf, np.ndarray) else leaf, tree)


@contextmanager
def in_numbers() -> Iterator[None]:
    """Context in which operations on numbers give numbers, also where JAX traces a function around it.

    Where it does not, nothing is changed: JAX would compile every operation on constants of what is traced inside.
    """
    traced_around = isinstance(jax.device_put(_ZERO), Tracer)
    with jax.ensure_compile_time_eval() if traced_around else nullcontext():
        yield


def library_of(*values: Any) -> Any:
    """NumPy where numbers are known, because JAX would compile a program for each operation; JAX's where one is traced.

    Both round sums, products, quotients and roots alike.
    """
    return jnp if any(isinstance(value, Tracer) for value in values) else np


def quotient(over: Any, under: Any) -> Any:
    """Array of one number, or array, over another."""
    return as_array(library_of(over, under).divide(over, under))


def product(left: Any, right: Any) -> Any:
    """Array of one number, or array, times another."""
    return as_array(library_of(left, right).multiply(left, right))


def in_present_precision(tree: Any) -> Any:
    """The tree of parts with its numbers converted to the precision that JAX uses now."""

    def converted(leaf: Any) -> Any:
        if not isinstance(leaf, jax.Array) or not jnp.issubdtype(leaf.dtype, jnp.floating):
            return leaf
        present = jax.dtypes.canonicalize_dtype(float)
        if leaf.dtype == present:
            return leaf
        return leaf.astype(present) if isinstance(leaf, Tracer) else as_array(np.asarray(leaf))

    return jax.tree.map(converted, tree)
