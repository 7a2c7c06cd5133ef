"""Arrays of a store as zarr keeps them: a file for every chunk, with a checksum."""

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

# Its checksum tells a chunk that was torn apart.
_CODEC = ZstdCodec(level=3, checksum=True)

# A chunk of nothing but zeros is a file, too: one that is gone is noticed.
_CONFIG: Any = {"write_empty_chunks": True}


def opened(path: Path) -> Any:
    """The group of a store, made when missing.

    Raises:
        BadInput: what is there is none.
    """
    try:
        return zarr.open_group(path, mode="a")
    except Exception as error:  # whatever zarr says of metadata that is no JSON, or not of a group
        got, hint = f"{path.parent}: zarr.json is damaged ({error})", "--overwrite begins anew"
        raise BadInput("--out", "hold a store that can be read", got, hint=hint) from error


def to_be_read(path: Path) -> Any:
    """The group of a store that another process may be writing to.

    Raises:
        FileNotFoundError: there is none.
    """
    return zarr.open_group(path, mode="r")


def found_array(group: Any, name: str) -> Any:
    """An array of an earlier process; nothing where it is gone or cannot be read: it is made anew."""
    try:
        return group[name].with_config(_CONFIG)
    except Exception:  # whatever zarr says of metadata that are none
        return None


def check_array(array: Any, label: Label, chunks: tuple[int, ...], path: Path) -> None:
    """That the metadata of an array are those that it was made with: with others, its chunks say something else.

    Args:
        array: as found; its shape may have grown.
        label: what it must hold.
        chunks: size of a chunk along its first axes; along the others there is one.
        path: of the store, for messages.

    Raises:
        BadInput: they are not.
    """
    chunks = (*chunks, *array.shape[len(chunks) :])
    made = new_array(zarr.open_group(MemoryStore()), "made", array.shape, chunks, label)
    found, wanted = array.metadata.to_dict(), made.metadata.to_dict()
    other = [key for key in wanted | found if _written(found.get(key)) != _written(wanted.get(key))]
    if other:
        got = f"{path / array.basename / 'zarr.json'} with another {', '.join(other)}"
        hint = f"Put it back as it was, or remove {array.basename}/: --resume makes it again"
        raise BadInput("--out", "hold a store as it was written", got, hint=hint)


def _written(value: Any) -> str:
    return json.dumps(value, sort_keys=True, default=str)


def flags(array: Any, count: int) -> np.ndarray:
    """Which of the first tasks are done; one whose flag cannot be read is not."""
    try:
        return np.asarray(array[:count]) != 0
    except Exception:  # whatever a codec says of a torn chunk: it is looked for
        found = np.zeros(count, dtype=bool)
        for task in range(count):
            with contextlib.suppress(Exception):
                found[task] = array[task] != 0
        return found


def new_array(group: Any, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], label: Label) -> Any:
    """An array of a group, in place of what a killed process may have left of it."""
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
    """Where zarr keeps a block of an array; of one that is gone it says that it is full of zeros."""
    return path.joinpath(name, "c", *map(str, block), *["0"] * (dimensions - len(block)))
