"""Numbers that others give, and compiled steps whose numbers are those of a part."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np

from undertow.core.errors import BadInput
from undertow.loop.stepped import Step


def numbers(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """A value as numbers of a shape.

    Raises:
        BadInput: it has another one, or holds something else.
    """
    try:
        if np.asarray(value).dtype.kind in "SU":  # NumPy takes "10" for a number
            raise TypeError
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(name, "be numbers" if shape else "be a number", repr(value)) from None
    if found.shape != shape:
        raise BadInput(name, f"have shape {shape}", f"of shape {found.shape}")
    return found


def step_of(function: Callable, part: Any, state: Any, inputs: Any) -> Step:
    """A compiled step whose numbers are those of a part: function(part, state, inputs) -> (state, outputs)."""
    of_part, rest = eqx.partition(part, eqx.is_array)
    return Step(
        lambda of_part, state, inputs: function(eqx.combine(of_part, rest), state, inputs), of_part, state, inputs
    )
