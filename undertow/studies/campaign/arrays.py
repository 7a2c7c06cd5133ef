"""Arrays of a store as zarr keeps them: a file for every chunk, with a checksum."""

from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.studies.campaign.columns import Label

try:
    import zarr
    from zarr.codecs import ZstdCodec
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
    except (KeyError, ValueError):
        return None


def new_array(
    group: Any, name: str, dtype: np.dtype, shape: tuple[int, ...], chunks: tuple[int, ...], label: Label
) -> Any:
    """An array of a group, in place of what a killed process may have left of it."""
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
