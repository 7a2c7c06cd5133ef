"""A function as JAX traces it, beside what its results hold that is no array."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jax.extend.core import Literal


class Form(NamedTuple):
    """How results are put together again.

    Attributes:
        structure: of the tree of their arrays.
        still: the rest of them; a tree.
    """

    structure: Any
    still: Any

    def whole(self, leaves: list[Any]) -> Any:
        """The tree of results, of its arrays."""
        return eqx.combine(jax.tree.unflatten(self.structure, leaves), self.still)


class Traced:
    """A traced function.

    Args:
        function: of trees of arrays.
        arguments: examples of them, or shapes and types.

    Attributes:
        closed: its jaxpr.
        shapes: of its results; a tree.
        still: the rest of its results; a tree.
    """

    def __init__(self, function: Callable, *arguments: Any):
        static_parts = []

        def arrays_only(*arguments):
            arrays, still = eqx.partition(function(*arguments), eqx.is_array)
            static_parts.append(still)
            return arrays

        self._function = arrays_only
        self.closed, self.shapes = jax.make_jaxpr(arrays_only, return_shape=True)(*arguments)
        self.still = static_parts[0]

    @property
    def form(self) -> Form:
        """Of its results."""
        return Form(jax.tree.structure(self.shapes), self.still)

    def passed_on(self) -> list[int | None]:
        """Which results are just arguments: their places among all arguments, None for others."""
        places = {variable: i for i, variable in enumerate(self.closed.jaxpr.invars)}
        return [None if isinstance(out, Literal) else places.get(out) for out in self.closed.jaxpr.outvars]

    def used(self) -> list[int]:
        """Places of the arguments that any equation goes by."""
        read = {one for equation in self.closed.jaxpr.eqns for one in equation.invars if not isinstance(one, Literal)}
        return [i for i, variable in enumerate(self.closed.jaxpr.invars) if variable in read]

    def only(self, used: list[bool]) -> Callable[..., list[jax.Array]]:
        """The function with some of its results."""

        def function(*arguments):
            leaves = jax.tree.leaves(self._function(*arguments))
            return [leaf for leaf, is_used in zip(leaves, used, strict=True) if is_used]

        return function

    @property
    def leaves(self) -> list[Any]:
        """Shapes of the results."""
        return jax.tree.leaves(self.shapes)

    @property
    def types(self) -> list[np.dtype]:
        """Types of the results."""
        return [leaf.dtype for leaf in self.leaves]


def same_types(values: Any, shapes: Any) -> bool:
    """Whether a tree of arrays has the structure of a tree of shapes, and their sizes and types."""
    alike = lambda a, b: np.shape(a) == b.shape and np.asarray(a).dtype == b.dtype
    leaves = jax.tree.leaves(values), jax.tree.leaves(shapes)
    return jax.tree.structure(values) == jax.tree.structure(shapes) and all(map(alike, *leaves))
