"""Cache of parts, so that thousands of similar scenarios are built quickly."""

import json
from collections.abc import Callable, Mapping
from typing import Any

from undertow.simulation.loop.loop_runs import structure

_MOST = 512  # parts that are remembered


class PartCache:
    """Makes a part once per description, and checks loops of the same structure once."""

    def __init__(self) -> None:
        self._made: dict[Any, tuple[Any, tuple[Any, ...]]] = {}
        self._checked: set[Any] = set()

    def copy(self) -> "PartCache":
        """Another cache with the same parts, for parts that shall not be kept."""
        copied = PartCache()
        copied._made, copied._checked = self._made.copy(), self._checked.copy()
        return copied

    def part(self, where: str, description: Mapping[str, Any], parts: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Result of `make`, cached by description and other parts.

        Args:
            where: key of the part.
            description: everything that `make` reads; plain data.
            parts: others that it is made from.
            make: makes the part.
        """
        try:
            text = json.dumps(description, sort_keys=True)
        except (TypeError, ValueError):  # arrays in Python data
            return make()
        key = (where, text, tuple(id(part) for part in parts))
        if key not in self._made:
            if len(self._made) >= _MOST:
                self._made.clear()
            self._made[key] = (make(), parts)  # keeps `parts` alive, so that their ids stay unique
        return self._made[key][0]

    def check_once(self, tree: Any, check: Callable[[], None]) -> None:
        """Call `check`, unless it has passed before for parts of this structure."""
        shape = structure(tree)
        if shape not in self._checked:
            check()
            self._checked.add(shape)
