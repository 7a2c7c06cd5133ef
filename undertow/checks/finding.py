"""Findings of checks: errors and advice in the form of all messages; checks of what the methods of a part return."""

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np


class Finding(NamedTuple):
    """One error or one advice."""

    level: Literal["error", "advice"]
    rule: str  # name of the rule, one word
    key: str  # key of the file, or method
    says: str  # with the numbers that caused it
    hint: str = ""  # remedy

    def sentence(self, where: str = "") -> str:
        """One line. `where` is the location in a file, when known."""
        place = f" ({where})" if where else ""
        return f"{self.level.capitalize()}: {self.says}{place}{f'. {self.hint}' if self.hint else ''}"


def error(rule: str, key: str, must: str, got: str, hint: str = "") -> Finding:
    """Finding of something impossible."""
    return Finding("error", rule, key, f"`{key}` must {must}, but is {got}", hint)


def advice(rule: str, key: str, should: str, got: str, hint: str = "") -> Finding:
    """Finding of something possible but unlikely."""
    return Finding("advice", rule, key, f"`{key}` should {should}, but is {got}", hint)


_TOLERANCE = 1e-6


def shaped(name: str, value: Any, *shapes: tuple[int, ...]) -> Iterator[Finding]:
    """Check for an array of one of these shapes, with finite numbers unless it is traced."""
    if not isinstance(value, jax.Array | jax.ShapeDtypeStruct | np.ndarray | np.generic | float | int):
        yield error("contract", name, f"give an array of shape {shapes[0]}", form(value))
    elif jnp.shape(value) not in shapes:
        yield error("contract", name, f"give arrays of shape {shapes[0]}", f"of shape {jnp.shape(value)}")
    elif not isinstance(value, jax.ShapeDtypeStruct) and not np.all(np.isfinite(value)):
        yield error("contract", name, "give finite numbers", str(np.asarray(value)))


def is_a(name: str, value: Any, kind: type) -> Iterator[Finding]:
    """Check for an instance of a class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIO" else "a"
        yield error("contract", name, f"give {article} {kind.__name__}", form(value))


def two_values(name: str, value: Any, what: str) -> Iterator[Finding]:
    """Check for a tuple of exactly two."""
    if type(value) is not tuple or len(value) != 2:
        says = f"`{name}` must return two values, {what}, but returns {form(value)}"
        yield Finding("error", "contract", name, says)


def alike(name: str, value: Any, model: Any, must: str, types: bool = False) -> Iterator[Finding]:
    """Check for the same tree as `model`, with arrays of the same shapes, and of the same types if `types`."""
    if type(value) is not type(model):
        yield error("contract", name, must, f"{_kind(value)}, not {_kind(model)}")
        return
    (found, tree), (due, model_tree) = map(jax.tree_util.tree_flatten_with_path, (value, model))
    if tree != model_tree:
        yield error("contract", name, must, f"a tree of {len(found)} arrays, not of {len(due)}, or with other names")
        return
    for (path, one), (_, other) in zip(found, due, strict=True):
        at = f" in `{jax.tree_util.keystr(path).lstrip('.')}`" if path else ""
        if jnp.shape(one) != jnp.shape(other):
            yield error("contract", name, must, f"of shape {jnp.shape(one)} instead of {jnp.shape(other)}{at}")
        elif types and one.dtype != other.dtype:
            yield error("contract", name, must, f"of type {one.dtype} instead of {other.dtype}{at}")


def agree(name: str, value: Any, other: Any, what: str) -> Iterator[Finding]:
    """Check for equal values."""
    off = np.abs(np.asarray(value) - np.asarray(other))
    scale = max(1.0, float(np.abs(np.asarray(other)).max(initial=0.0)))
    if off.max(initial=0.0) > _TOLERANCE * scale:
        i = int(off.argmax())
        got = f"{np.ravel(value)[i]:.6g} instead of {np.ravel(other)[i]:.6g} in entry {i + 1}"
        yield error("contract", name, f"agree with {what}", got)


def _kind(value: Any) -> str:
    return "an array" if isinstance(value, jax.Array | jax.ShapeDtypeStruct) else f"a {type(value).__name__}"


def form(value: Any) -> str:
    """Description of a returned value."""
    if value is None:
        return "nothing (no `return`?)"
    if isinstance(value, jax.Array | jax.ShapeDtypeStruct):
        return f"an array of shape {value.shape}"
    if type(value) is tuple:
        return f"{len(value)} values" if len(value) != 1 else "one value"
    return f"a {type(value).__name__}"
