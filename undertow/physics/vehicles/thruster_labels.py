"""Names of thrusters: `T5` with the vehicle's own name for it, or with what its pose tells."""

import re
from collections.abc import Callable, Sequence

import numpy as np

from undertow.core import checks
from undertow.core.errors import BadInput

_NEAR = 0.1  # share of the largest lever within which a thruster is in the middle
_PUSHES, _ALONG = {1: "lateral", 2: "vertical"}, 0.9  # body axes, and the part of its direction along one of them
# Names stand in lists with commas, in figures, in attributes of files and in messages of one line.
_PLAIN, _LONGEST = re.compile(r"\w[\w .-]*"), 24


def labels(positions, directions, own: Sequence[str]) -> tuple[str, ...]:
    """T1, T2, ... each with its own name, or with what the pose tells.

    Args:
        positions: m, shape (N, 3).
        directions: of positive thrust, shape (N, 3).
        own: names of the vehicle's own, "" for a thruster without one; () for none at all.
    """
    names = own or ("",) * len(positions)
    if not all(names) and not checks.traced(positions, directions):  # what is traced has no words
        places = _places(np.asarray(positions), np.asarray(directions))
        names = tuple(name or place for name, place in zip(names, places, strict=True))
    return tuple(f"T{number} {name}".rstrip() for number, name in enumerate(names, 1))


def _places(positions: np.ndarray, directions: np.ndarray) -> list[str]:
    """`vertical bow port` pushes along z, ahead of the origin, to port. One that pushes along y is `lateral`."""
    near = _NEAR * max(np.abs(positions).max(), 1e-9)
    found = []
    for (x, y, _), direction in zip(positions, directions, strict=True):
        words = [word for axis, word in _PUSHES.items() if abs(direction[axis]) > _ALONG]
        words += [word for at, word in ((x, "bow"), (-x, "stern"), (-y, "port"), (y, "starboard")) if at > near]
        found.append(" ".join(words))
    return found


def check_own(names: Sequence[str], key: Callable[[int], str]) -> None:
    """Check names of a vehicle's own, "" for a thruster without one.

    Args:
        names: one per thruster.
        key: what the name of the thruster of an index is called in errors.

    Raises:
        BadInput: a name that has other signs than letters, digits, spaces and `_.-`, is too long, or occurs twice.
    """
    before: dict[str, int] = {}
    for j, name in enumerate(names):
        if not name:
            continue
        if not _PLAIN.fullmatch(name):
            raise BadInput(key(j), "be of letters, digits, spaces and _ . -, and begin with a letter or digit", name)
        if len(name) > _LONGEST:
            raise BadInput(key(j), f"be at most {_LONGEST} characters long", f"{len(name)} long")
        same = before.setdefault(name.casefold(), j)
        if same != j:
            raise BadInput(key(j), f"differ from `{key(same)}`", name)


def without_number(label: str) -> str:
    """`stern port` of `T3 stern port`."""
    return label.partition(" ")[2]


def number_of(text: str, names: Sequence[str]) -> int | None:
    """Number from 1 of the thruster that a text names, with or without its `T2`; None where none or several fit."""
    asked = " ".join(text.split()).casefold()
    both = [(name.casefold(), without_number(name).casefold()) for name in names]
    fitting = [number for number, forms in enumerate(both, 1) if asked in forms]
    return fitting[0] if asked and len(fitting) == 1 else None
