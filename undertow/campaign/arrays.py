"""Zarr arrays of a results store: one file per chunk, with a checksum."""

import contextlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from undertow.campaign.columns import Label
from undertow.core.errors import BadInput

try:
    import zarr
    from zarr.codecs import ZstdCodec
    from zarr.storage import MemoryStore
except ModuleNotFoundError:
    raise BadInput("campaign", "find zarr installed", "not", hint="pip install 'undertow[campaign]'") from None

# The checksum reveals a chunk that was written only in part.
_CODEC = ZstdCodec(level=3, checksum=True)

# A chunk of zeros is written as a file too, so that a missing chunk is noticed.
_CONFIG: Any = {"write_empty_chunks": True}


def opened(path: Path) -> Any:
    """The group of a store, created if missing.

    Raises:
        BadInput: the store is damaged.
    """
    try:
        return zarr.open_group(path, mode="a")
    except Exception as error:  # whatever zarr says of metadata that is no JSON, or not of a group
        got, hint = f"{path.parent}: zarr.json is damaged ({error})", "Use --overwrite to start again"
        raise BadInput("--out", "hold a store that can be read", got, hint=hint) from error


def to_be_read(path: Path) -> Any:
    """The group of a store that another process may be writing to.

    Raises:
        FileNotFoundError: there is none.
    """
    return zarr.open_group(path, mode="r")


def found_array(group: Any, name: str) -> Any:
    """An array of an earlier process; None where it is missing or unreadable, and then created again."""
    try:
        return group[name].with_config(_CONFIG)
    except Exception:  # whatever zarr says of metadata that are none
        return None


def check_array(array: Any, label: Label, chunks: tuple[int, ...], path: Path) -> None:
    """Check that the metadata of an array are those it was created with: others would change the meaning of its chunks.

    Args:
        array: as found; its shape may have grown.
        label: what it must hold.
        chunks: size of a chunk along its first axes; along the others there is one.
        path: of the store, for messages.

    Raises:
        BadInput: the metadata differ.
    """
    chunks = (*chunks, *array.shape[len(chunks) :])
    made = new_array(zarr.open_group(MemoryStore()), "made", array.shape, chunks, label)
    found, expected = array.metadata.to_dict(), made.metadata.to_dict()
    other = [key for key in expected | found if _written(found.get(key)) != _written(expected.get(key))]
    if other:
        got = f"{path / array.basename / 'zarr.json'} with another {', '.join(other)}"
        hint = f"Restore it, or remove {array.basename}/ and use --resume to compute it again"
        raise BadInput("--out", "hold a store as it was written", got, hint=hint)


def _written(value: Any) -> str:
    return json.dumps(value, sort_keys=True, default=str)


def flags(array: Any, count: int) -> np.ndarray:
    """Which of the first tasks are done; a task whose flag cannot be read is not."""
    try:
        return np.asarray(array[:count]) != 0
    except Exception:  # whatever a codec says of a torn chunk: it is looked for
        found = np.zeros(count, dtype=bool)
        for task in range(count):
            with contextlib.suppress(Exception):
                found[task] = array[task] != 0
        return found


def new_array(group: Any, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], label: Label) -> Any:
    """A new array of a group, replacing what a killed process may have left."""
    dtype = np.dtype(label.dtype)
    return group.create_array(
        name,
        shape=shape,
        chunks=chunks,
        dtype=str if dtype.kind == "U" else dtype,
        fill_value={"f": np.nan, "U": ""}.get(dtype.kind, 0),
        dimension_names=label.dimensions,
        compressors=[_CODEC],
        attributes=label.attributes,  # at once: killed between the two, an array would stay without them
        overwrite=True,
        config=_CONFIG,
    )


def chunk_file(path: Path, name: str, block: tuple[int, ...], dimensions: int) -> Path:
    """File of a block of an array; zarr reads a missing file as zeros."""
    return path.joinpath(name, "c", *map(str, block), *["0"] * (dimensions - len(block)))
