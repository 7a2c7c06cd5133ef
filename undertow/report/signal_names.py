"""Names of the outputs and inputs of a run, as figures and tables show them."""

import xarray as xr


def axis_names(run: xr.Dataset) -> list[str]:
    """Names of the outputs: north, east, ..."""
    return [str(name) for name in run["axis"].values]


def controller_axis_names(run: xr.Dataset) -> list[str]:
    """Names of the axes of the uncertainty and of the controller's signals: the outputs, or surge, sway, ..."""
    names = run["axis"].attrs.get("controller_axes")
    return names.split(", ") if names else axis_names(run)


def input_names(run: xr.Dataset) -> list[str]:
    """Names of the inputs: T1 bow port, ...; numbers in the results of earlier versions."""
    names = run["actuator"].attrs.get("names")
    return names.split(", ") if names else [f"input {number}" for number in run["actuator"].values]
