"""Figures of a run: what they show, and how they are written."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

# Least span of an axis, by its unit: what is smaller is of no account to a vehicle.
FLOORS = {"m": 0.01, "deg": 1.0, "m/s": 0.01, "rad/s": 0.01}
LEAST_PATH = 0.2  # m; a path on a smaller map would show noise
# Errors of the first picture: unit -> title, and the metric that has their limit.
ERRORS = {"m": ("position error, m", "position_rms"), "deg": ("attitude error, deg", "attitude_rms")}


class Shown(NamedTuple):
    """What the figures of a run show. It takes little to send it to another process, which needs no JAX for it.

    Attributes:
        series: recorded ones.
        faults: entries of the scenario.
        certificate: with the bound of the weights; None where it is not known.
        criterion: what success is judged by: metric -> what it must stay below.
        supply: largest input, V; None where it is not known.
    """

    series: xr.Dataset
    faults: Sequence[Mapping[str, Any]] = ()
    certificate: Mapping[str, Any] | None = None
    criterion: Mapping[str, float] = {}
    supply: float | None = None


class Plotted(NamedTuple):
    """Figures of a run.

    Attributes:
        files: what the files hold, by their names.
        pictures: what the page shows: PNG, by the name of the figure.
        failures: a sentence for each figure that could not be made.
    """

    files: Mapping[str, bytes]
    pictures: Mapping[str, bytes]
    failures: list[str]

    def write(self, folder: Path) -> None:
        """Write the files into a folder, which is made if need be.

        Raises:
            OSError: the folder cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in self.files.items():
            (folder / name).write_bytes(data)
