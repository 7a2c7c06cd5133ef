"""Opening the result file of a run, which may be damaged or hostile."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from undertow.core.unpacked_size import size_complaint

if TYPE_CHECKING:
    import xarray as xr


class UnreadableResult(Exception):
    """A result file cannot be read; the message says what it is."""


@contextlib.contextmanager
def opened_result(path: Path) -> Iterator["xr.Dataset"]:
    """The dataset of a result file, open inside the block.

    Raises:
        UnreadableResult: it is missing, no netCDF file, damaged, or would unpack to more than a run has.
    """
    import xarray as xr

    if not path.exists():
        raise UnreadableResult("missing")
    if path.stat().st_size == 0:
        raise UnreadableResult("empty (0 bytes)")
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            if complaint := size_complaint(path, dataset.nbytes):
                raise UnreadableResult(complaint)
            yield dataset
    except UnreadableResult:
        raise
    except Exception as error:  # netCDF and xarray raise many kinds of errors for whatever bytes there are
        raise UnreadableResult("damaged, incomplete, or not a netCDF file") from error
