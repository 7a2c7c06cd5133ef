"""State of an autopilot as bytes: what it is of, the numbers, and a checksum, because files may be damaged."""

import hashlib
import itertools
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from undertow.core.errors import BadInput

_MAGIC = b"undertow autopilot state 1\n"
_HASH, _SUM = 32, 4  # bytes


def packed(identity: bytes, arrays: Sequence[np.ndarray]) -> bytes:
    """Arrays as bytes; `identity` tells states of one autopilot from those of others."""
    body = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    whole = _MAGIC + hashlib.sha256(identity).digest() + body
    return whole + zlib.crc32(whole).to_bytes(_SUM, "little")


def unpacked(state: Any, identity: bytes, like: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Arrays like others, from the bytes of `packed`.

    Raises:
        BadInput: these are not the bytes of a state, are damaged, or belong to another autopilot.
    """
    if not isinstance(state, bytes | bytearray | memoryview):
        raise BadInput("state", "be the bytes that `save` gives", f"a {type(state).__name__}")
    given, head = bytes(state), len(_MAGIC) + _HASH
    if not given.startswith(_MAGIC):
        raise BadInput("state", "be the bytes that `save` gives", f"{len(given)} other bytes")
    whole, ends = given[:-_SUM], given[-_SUM:]
    if zlib.crc32(whole).to_bytes(_SUM, "little") != ends:
        raise BadInput("state", "be undamaged", "damaged: its checksum is wrong")
    sizes = [array.nbytes for array in like]
    if whole[len(_MAGIC) : head] != hashlib.sha256(identity).digest() or len(whole) != head + sum(sizes):
        raise BadInput("state", "be that of the same controller with the same numbers and formats", "of another")
    ends_at = np.cumsum([head, *sizes])
    parts = [whole[start:end] for start, end in itertools.pairwise(ends_at)]
    return [np.frombuffer(part, array.dtype).reshape(array.shape) for part, array in zip(parts, like, strict=True)]


def restore_arrays(arrays: Sequence[np.ndarray], state: Any, identity: bytes) -> None:
    """Write the numbers that `packed` made into arrays like those it was given.

    Raises:
        BadInput: see `unpacked`; then all arrays stay as they were.
    """
    for array, value in zip(arrays, unpacked(state, identity, arrays), strict=True):
        array[...] = value
