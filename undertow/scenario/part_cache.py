"""Parts that were made before: what thousands of similar scenarios need to be built quickly."""

import json
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax

_MOST = 512  # parts that are remembered


class PartCache:
    """Makes a part once for each description, and lets loops of the same shape be checked once."""

    def __init__(self) -> None:
        self._made: dict[Any, tuple[Any, tuple[Any, ...]]] = {}
        self._checked: set[Any] = set()

    def part(self, where: str, description: Mapping[str, Any], given: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Result of `make`, or what it was for the same description and the same other parts.

        Args:
            where: key of the part.
            description: everything that `make` reads; plain data.
            given: parts that it is made from.
            make: what makes it.
        """
        try:
            told = json.dumps(description, sort_keys=True)
        except (TypeError, ValueError):  # arrays in Python data
            return make()
        key = (where, told, tuple(id(part) for part in given))
        if key not in self._made:
            if len(self._made) >= _MOST:
                self._made.clear()
            self._made[key] = (make(), given)  # with `given` alive, its identity stays its own
        return self._made[key][0]

    def check_once(self, tree: Any, check: Callable[[], None]) -> None:
        """Call `check`, unless it has passed for a tree of parts of this shape before."""
        shape = structure(tree)
        if shape not in self._checked:
            check()
            self._checked.add(shape)


def structure(tree: Any) -> Any:
    """Everything about a tree of parts but its numbers: equal where one compiled program serves both."""
    leaves, form = jax.tree.flatten(tree)
    return form, tuple((leaf.shape, leaf.dtype) if eqx.is_array(leaf) else leaf for leaf in leaves)
