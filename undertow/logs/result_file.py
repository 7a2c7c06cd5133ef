"""Opening the result file of a run, which may be damaged or hostile."""

import contextlib
import functools
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from undertow.core.process_setup import python_command
from undertow.core.unpacked_size import size_complaint

if TYPE_CHECKING:
    import xarray as xr

# HDF5 reads some damaged heaps for ever, and nothing ends that in this process. To open a file of any size takes a
# quarter of a second there, most of it the import.
_LONGEST = 20.0  # s


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
    status = path.stat()
    if status.st_size == 0:
        raise UnreadableResult("empty (0 bytes)")
    if not _opens(path.absolute(), status.st_size, status.st_mtime_ns):
        raise UnreadableResult("damaged: the netCDF library does not finish opening it")
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            if complaint := size_complaint(path, dataset.nbytes):
                raise UnreadableResult(complaint)
            yield dataset
    except UnreadableResult:
        raise
    except Exception as error:  # netCDF and xarray raise many kinds of errors for whatever bytes there are
        raise UnreadableResult("damaged, incomplete, or not a netCDF file") from error


@functools.lru_cache(64)
def _opens(path: Path, size: int, modified: int) -> bool:
    """Whether another process comes to an end, well or with an error, when it opens a netCDF file.

    A repetition opens the same file several times: it is tried once for its size (bytes) and time of change (ns).
    """
    command = [*python_command("from netCDF4 import Dataset; Dataset(sys.argv[1]).close()"), str(path)]
    quiet = subprocess.DEVNULL
    try:
        return subprocess.run(command, stdout=quiet, stderr=quiet, timeout=_LONGEST, check=False).returncode >= 0
    except subprocess.TimeoutExpired:
        return False
    except OSError:  # no process can be started: opened here, as it is
        return True
