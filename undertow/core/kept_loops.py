"""Loops of the batch compiler that are kept from one process to the next, and found again without tracing."""

import threading
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from undertow.core.batch_compiler import Unsupported, simdjit
from undertow.core.kept_code import kept_code
from undertow.core.process_setup import cache_folder
from undertow.core.program_key import kept_key, program_key
from undertow.core.structure_key import Constant

# Loops of this process by key, in the order in which they were first used; or why there is none.
_LOOPS: dict[str, "simdjit.Loop | str"] = {}
_LOOPS_LOCK = threading.Lock()
_MOST_LOOPS = 64

# What is written of a loop that cannot be made, before the reason.
_UNSUPPORTED = b"unsupported: "


def kept_loop(structure: tuple[Any, ...], make: Callable[[bool], "simdjit.Loop"]) -> "simdjit.Loop":
    """The loop of a structure, without tracing where this process or an earlier one has made it.

    Args:
        structure: all that its code depends on.
        make: compiles it; whether it is to be written for later processes.

    Raises:
        Unsupported: `make` raises it, or did in an earlier process.
    """
    key = program_key(*structure)
    return make(False) if key is None else loop_of_key(key, make)


def loop_of_key(key: str, make: Callable[[bool], "simdjit.Loop"]) -> "simdjit.Loop":
    """`kept_loop` of a structure that has a key in this process."""
    with _LOOPS_LOCK:
        known = _LOOPS.get(key)
    if known is None:
        try:
            known = kept_or_made(key, make, lambda written: simdjit.Loop.read(written, cache_folder() / "native"))
        except Unsupported as error:
            known = str(error)
        with _LOOPS_LOCK:
            if len(_LOOPS) >= _MOST_LOOPS:
                _LOOPS.pop(next(iter(_LOOPS)))
            known = _LOOPS.setdefault(key, known)
    if isinstance(known, str):
        raise Unsupported(known)
    return known


def kept_or_made(key: str, make: Callable[[bool], Any], read: Callable[[bytes], Any]) -> Any:
    """What `make` compiles, or what `read` makes of what an earlier process has written.

    Args:
        key: of this process.
        make: compiles it; whether it is to be written.
        read: from what was written.

    Raises:
        Unsupported: `make` raises it, or did in an earlier process.
    """
    kept = kept_key(key)
    if kept is None:
        return make(False)
    made: list[Any] = []

    def written() -> bytes:
        try:
            made.append(make(True))
        except Unsupported as error:
            return _UNSUPPORTED + str(error).encode()
        try:
            return made[0].written()
        except Unsupported:
            return b""

    contents = kept_code(kept, written)
    if made:
        return made[0]
    if contents.startswith(_UNSUPPORTED):
        raise Unsupported(contents.removeprefix(_UNSUPPORTED).decode())
    try:
        return read(contents)
    except Exception:  # of one that cannot be written there is nothing; and whatever is said of code that does not fit
        return make(False)


def numbers_contained(arrays: Any, constant: Sequence[bool]) -> Constant:
    """Numbers that a program contains, for its structure.

    Args:
        arrays: of its arguments; a tree.
        constant: which of them it contains.
    """
    leaves = zip(jax.tree.leaves(arrays), constant, strict=True)
    return Constant([leaf if same else None for leaf, same in leaves])


def decides_structure(leaf: Any) -> bool:
    """Whether an array of a single run is built into its program, because its values decide what is left out there.

    Those are arrays of zeros and ones, and of counts and switches. All others are read by the program, so that it
    serves every run of its kind: after a change of one number nothing is compiled again. The bits of a run are the same
    either way, and so is its speed within a tenth.
    """
    values = np.asarray(leaf)
    if values.dtype == np.uint32:  # keys of random numbers
        return False
    return values.dtype.kind != "f" or bool(((values == 0) | (values == 1)).all())
