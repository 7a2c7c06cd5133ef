"""How much a file may unpack to: small files can be made that unpack to any size."""

from pathlib import Path

_MOST, _TIMES = 2**28, 100  # bytes, or the size of the file times this where that is more


def most_unpacked(size: int) -> int:
    """Bytes that are read of what a file of a size (bytes) unpacks to."""
    return max(_MOST, _TIMES * size)


def size_complaint(path: Path, unpacked: int) -> str:
    """What is wrong with a file that would unpack to so many bytes; "" if that is not too much."""
    most = most_unpacked(path.stat().st_size)
    return f"one of {unpacked} bytes unpacked, more than the {most} that are read" if unpacked > most else ""
