"""What the methods of a part return, compared with what their contract says; in words, for messages.

Only types and shapes are looked at, so that the checks cost nothing in compiled code.
"""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.errors import BadInput
from undertow.core.user_code import place_of

STATE = "return the state in the form that `init` gives it"  # of `advance`
PAIR = "the input and the signals"  # of `command`


def form(value: Any) -> str:
    """Description of a returned value."""
    if value is None:
        return "nothing (no `return`?)"
    if isinstance(value, jax.Array | jax.ShapeDtypeStruct):
        return f"an array of shape {value.shape}"
    if type(value) is tuple:
        return f"{len(value)} values" if len(value) != 1 else "one value"
    return f"a {type(value).__name__}"


def not_two(method: str, value: Any, what: str) -> str:
    """Sentence where a method does not return a tuple of exactly two; "" where it does."""
    if type(value) is tuple and len(value) == 2:
        return ""
    return f"`{method}` must return two values, {what}, but returns {form(value)}"


def difference(value: Any, model: Any, types: bool = False) -> str:
    """How a value differs from the tree `model`, or from its shapes (and types if `types`); "" where it does not."""
    if type(value) is not type(model) and not (_is_array(value) and _is_array(model)):
        return f"{_kind(value)}, not {_kind(model)}"
    (leaves, tree), (model_leaves, model_tree) = map(jax.tree_util.tree_flatten_with_path, (value, model))
    if tree != model_tree:
        return f"a tree of {len(leaves)} arrays, not of {len(model_leaves)}, or with other names"
    for (path, leaf), (_, model_leaf) in zip(leaves, model_leaves, strict=True):
        at = f" in `{jax.tree_util.keystr(path).lstrip('.')}`" if path else ""
        if jnp.shape(leaf) != jnp.shape(model_leaf):
            return f"of shape {jnp.shape(leaf)} instead of {jnp.shape(model_leaf)}{at}"
        if types and jnp.result_type(leaf) != jnp.result_type(model_leaf):
            return f"of type {jnp.result_type(leaf)} instead of {jnp.result_type(model_leaf)}{at}"
    return ""


def check_command(controller: Any, answer: Any, inputs: int) -> None:
    """Check that `command` returned an input of the plant and signals.

    Raises:
        BadInput: it did not.
    """
    method = f"{type(controller).__name__}.command"
    message = not_two(method, answer, PAIR)
    if not message and jnp.shape(answer[0]) != (inputs,):
        due = f"must return an input of shape {(inputs,)}, one entry per input of the plant"
        message = f"`{method}` {due}, but returns {form(answer[0])}"
    if not message and not isinstance(answer[1], Mapping):
        message = f"`{method}` must return its signals as a mapping, {{}} for none, but returns {form(answer[1])}"
    if message:
        raise BadInput("", "", message, where=place_of(controller, "command"))


def check_state(controller: Any, after: Any, before: Any) -> None:
    """Check that `advance` returned the state of a controller in the form that `init` gave it.

    Raises:
        BadInput: it did not.
    """
    if got := difference(after, before, types=True):
        message = f"`{type(controller).__name__}.advance` must {STATE}, but is {got}"
        raise BadInput("", "", message, where=place_of(controller, "advance"))


def _kind(value: Any) -> str:
    if value is None:
        return "nothing (no `return`?)"
    return "an array" if _is_array(value) else f"a {type(value).__name__}"


def _is_array(value: Any) -> bool:
    return isinstance(value, jax.Array | jax.ShapeDtypeStruct | np.ndarray | np.generic | float | int)
