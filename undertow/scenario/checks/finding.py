"""Findings of checks: errors and advice in the form of all messages; checks of what the methods of a part return."""

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.return_checks import difference, form, not_two


class Finding(NamedTuple):
    """One error or one advice."""

    level: Literal["error", "advice"]
    rule: str  # name of the rule, one word
    key: str  # key of the file, or method
    says: str  # with the numbers that caused it
    hint: str = ""  # remedy

    def sentence(self, where: str = "") -> str:
        """One line. `where` is the location in a file, when known."""
        location = f" ({where})" if where else ""
        return f"{self.level.capitalize()}: {self.says}{location}{f'. {self.hint}' if self.hint else ''}"


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
    if message := not_two(name, value, what):
        yield Finding("error", "contract", name, message)


def same_structure(name: str, value: Any, model: Any, must: str, types: bool = False) -> Iterator[Finding]:
    """Check for the same tree as `model`, with arrays of the same shapes, and of the same types if `types`."""
    if got := difference(value, model, types):
        yield error("contract", name, must, got)


def agree(name: str, value: Any, other: Any, what: str) -> Iterator[Finding]:
    """Check for equal values."""
    deviation = np.abs(np.asarray(value) - np.asarray(other))
    scale = max(1.0, float(np.abs(np.asarray(other)).max(initial=0.0)))
    if deviation.max(initial=0.0) > _TOLERANCE * scale:
        i = int(deviation.argmax())
        got = f"{np.ravel(value)[i]:.6g} instead of {np.ravel(other)[i]:.6g} in entry {i + 1}"
        yield error("contract", name, f"agree with {what}", got)
