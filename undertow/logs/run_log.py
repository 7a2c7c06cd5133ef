"""A run of undertow as a log: the dataset of a result file."""

from pathlib import Path
from typing import TYPE_CHECKING

from undertow.core.errors import BadInput
from undertow.logs.known_signals import thruster_columns
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.messages import group_of
from undertow.logs.result_file import UnreadableResult, opened_result

if TYPE_CHECKING:
    import xarray as xr

_MUST = "be the run.nc of a run"

# Attributes of a run that a log keeps: what it takes to repeat it, and who made it.
_KEPT = ("title", "seed", "status", "scenario", "scenario_hash", "content_hash", "version_undertow")


def log_of_run(run: "xr.Dataset", source: str = "run.nc") -> Log:
    """The series of a run, with its names, units and meanings."""
    time = run["time"].values
    signals = {
        name: Series(
            time,
            variable.values,
            _columns(run, str(name), variable),
            variable.attrs.get("units", "1"),
            variable.attrs.get("long_name", ""),
        )
        for name, variable in run.data_vars.items()
        if variable.dims[:1] == ("time",)
    }
    facts = {key: str(run.attrs[key]) for key in _KEPT if key in run.attrs}
    names = run["actuator"].attrs.get("names", "") if "actuator" in run.coords else ""
    return Log(
        {str(name): series for name, series in signals.items()}, source, "undertow", (), facts | {"actuators": names}
    )


def _columns(run: "xr.Dataset", name: str, variable: "xr.DataArray") -> tuple[str, ...]:
    """Names of the columns; the law's signals, and what it estimates, are in its own axes."""
    if variable.ndim < 2:
        return ()
    dimension = variable.dims[1]
    if dimension == "axis":
        law_axes = run["axis"].attrs.get("controller_axes", "") if group_of(name) == "controller" else ""
        return tuple(law_axes.split(", ")) if law_axes else tuple(map(str, run["axis"].values))
    if dimension == "actuator":
        return thruster_columns(variable.shape[1])
    return tuple(str(i + 1) for i in range(variable.shape[1]))


def read_run(path: Path) -> Log:
    """The log of a result file.

    Raises:
        BadInput: it is none, or damaged.
    """
    run = read_dataset(path, "log")
    try:
        return log_of_run(run, path.name)
    except Exception as error:  # a netCDF file of something else
        raise BadInput("log", _MUST, f"{path.name}: {str(error) or type(error).__name__}") from None


def read_dataset(path: Path, name: str) -> "xr.Dataset":
    """All of a result file.

    Args:
        path: of the file.
        name: of what it is, for messages.

    Raises:
        BadInput: it is no netCDF file, damaged, or would unpack to more than a run has.
    """
    try:
        with opened_result(path) as dataset:
            return dataset.load()
    except UnreadableResult as error:
        raise BadInput(name, _MUST, f"{path.name}, which is {error}") from None
