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
    content = _MAGIC + hashlib.sha256(identity).digest() + body
    return content + zlib.crc32(content).to_bytes(_SUM, "little")


def unpacked(state: Any, identity: bytes, like: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Arrays like others, from the bytes of `packed`.

    Raises:
        BadInput: these are not the bytes of a state, are damaged, or belong to another autopilot.
    """
    if not isinstance(state, bytes | bytearray | memoryview):
        raise BadInput("state", "be the bytes that `save` gives", f"a {type(state).__name__}")
    data = bytes(state)
    header_size = len(_MAGIC) + _HASH
    if not data.startswith(_MAGIC):
        raise BadInput("state", "be the bytes that `save` gives", f"{len(data)} other bytes")
    content = data[:-_SUM]
    checksum = data[-_SUM:]
    if zlib.crc32(content).to_bytes(_SUM, "little") != checksum:
        raise BadInput("state", "be undamaged", "damaged: its checksum is wrong")
    sizes = [array.nbytes for array in like]
    is_same = content[len(_MAGIC) : header_size] == hashlib.sha256(identity).digest()
    if not is_same or len(content) != header_size + sum(sizes):
        raise BadInput("state", "be that of the same controller with the same numbers and formats", "of another")
    ends_at = np.cumsum([header_size, *sizes])
    parts = [content[start:end] for start, end in itertools.pairwise(ends_at)]
    return [np.frombuffer(part, array.dtype).reshape(array.shape) for part, array in zip(parts, like, strict=True)]


def restore_arrays(arrays: Sequence[np.ndarray], state: Any, identity: bytes) -> None:
    """Write the numbers that `packed` made into arrays like those it was given.

    Raises:
        BadInput: see `unpacked`; then all arrays stay as they were.
    """
    for array, value in zip(arrays, unpacked(state, identity, arrays), strict=True):
        array[...] = value
