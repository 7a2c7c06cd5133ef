"""Unpacks what is compressed in bags, up to a size: small files can be made that unpack to any size."""

import bz2
from pathlib import Path

from undertow.core.unpacked_size import most_unpacked

_MAGIC = b"\x28\xb5\x2f\xfd"  # which begins no message in CDR
_LARGEST = 2**26  # bytes of a message
LARGEST_CHUNK = 2**26  # bytes of an unpacked chunk
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


def unpacked_chunk(compression: str, data: bytes, size: int) -> bytes:
    """The data of a chunk that declares its unpacked size.

    Raises:
        ValueError: it is too large, or has another size.
    """
    if size > LARGEST_CHUNK:
        raise ValueError(f"a chunk of {size} bytes, more than the {LARGEST_CHUNK} that are read")
    content = begin_of_chunk(compression, data, size + 1)
    if len(content) != size:
        raise ValueError(
            f"a chunk of {'more' if len(content) > size else 'fewer'} than the {size} bytes that it declares"
        )
    return content


def begin_of_chunk(compression: str, data: bytes, most: int) -> bytes:
    """The first bytes of the data of a chunk, which may be cut off. Raises whatever damaged bytes cause."""
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().stream_reader(data).read(most)
    if compression == "lz4":
        import lz4.frame

        return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most)
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress(data, max_length=most)
    return data


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
