"""Unpacks what is compressed as Zstandard, up to a size: small files can be made that unpack to any size."""

from pathlib import Path

from undertow.core.unpacked_size import most_unpacked

_MAGIC = b"\x28\xb5\x2f\xfd"  # which begins no message in CDR
_LARGEST = 2**26  # bytes of a message
_PIECE = 2**16


def unpacked(data: bytes) -> bytes:
    """The bytes of a message, which some bags compress.

    Raises:
        ValueError: they are too many.
    """
    if not data.startswith(_MAGIC):
        return data
    import zstandard

    reader = zstandard.ZstdDecompressor().stream_reader(data)
    content = bytearray()
    while piece := reader.read(_PIECE):
        content += piece
        if len(content) > _LARGEST:
            raise ValueError(f"a message of more than the {_LARGEST} bytes that are read")
    return bytes(content)


def unpacked_file(file: Path, folder: Path) -> Path:
    """A compressed file, unpacked into a folder under its name without the last suffix.

    Raises:
        ValueError: it is too large.
    """
    import zstandard

    most = most_unpacked(file.stat().st_size)
    target = folder / file.stem
    size = 0
    with file.open("rb") as packed, target.open("wb") as stream:
        reader = zstandard.ZstdDecompressor().stream_reader(packed)
        while piece := reader.read(_PIECE):
            size += len(piece)
            if size > most:
                raise ValueError(f"{file.name} unpacks to more than the {most} bytes that are read of it")
            stream.write(piece)
    return target
