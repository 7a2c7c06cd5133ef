"""Whether answers of a part have the shape, the form and the values that they must have."""

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.checks.finding import Finding, error

_TOLERANCE = 1e-6


def shaped(name: str, value: Any, *shapes: tuple[int, ...]) -> Iterator[Finding]:
    """An array of one of these shapes, of finite numbers unless it is only traced."""
    if not isinstance(value, jax.Array | jax.ShapeDtypeStruct | np.ndarray | np.generic | float | int):
        yield error("contract", name, f"give an array of shape {shapes[0]}", _form(value))
    elif jnp.shape(value) not in shapes:
        yield error("contract", name, f"give arrays of shape {shapes[0]}", f"of shape {jnp.shape(value)}")
    elif not isinstance(value, jax.ShapeDtypeStruct) and not np.all(np.isfinite(value)):
        yield error("contract", name, "give finite numbers", str(np.asarray(value)))


def is_a(name: str, value: Any, kind: type) -> Iterator[Finding]:
    """Something of a class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIO" else "a"
        yield error("contract", name, f"give {article} {kind.__name__}", _form(value))


def alike(name: str, value: Any, model: Any, must: str) -> Iterator[Finding]:
    """The same tree as `model`, with arrays of the same shapes."""
    forms = [jax.tree.structure(tree) for tree in (value, model)]
    shapes = [[jnp.shape(leaf) for leaf in jax.tree.leaves(tree)] for tree in (value, model)]
    if type(value) is not type(model):
        yield error("contract", name, must, f"a {type(value).__name__}, not a {type(model).__name__}")
    elif forms[0] != forms[1] or shapes[0] != shapes[1]:
        yield error("contract", name, must, f"of shapes {shapes[0]} instead of {shapes[1]}")


def agree(name: str, value: Any, other: Any, what: str) -> Iterator[Finding]:
    """Equal values."""
    off = np.abs(np.asarray(value) - np.asarray(other))
    scale = max(1.0, float(np.abs(np.asarray(other)).max(initial=0.0)))
    if off.max(initial=0.0) > _TOLERANCE * scale:
        i = int(off.argmax())
        got = f"{np.ravel(value)[i]:.6g} instead of {np.ravel(other)[i]:.6g} in entry {i + 1}"
        yield error("contract", name, f"agree with {what}", got)


def _form(value: Any) -> str:
    if value is None:
        return "nothing (no `return`?)"
    if isinstance(value, jax.Array | jax.ShapeDtypeStruct):
        return f"an array of shape {value.shape}"
    return f"of type {type(value).__name__}"
