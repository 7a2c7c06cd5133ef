"""Names of the outputs and inputs of a run, as figures and tables show them, and of thrusters that were lost."""

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


def lost_thrusters(series: xr.Dataset) -> list[tuple[str, float]] | None:
    """Name of each thruster that was taken out of use, and the time of the first record of that, s, in its order.

    None for a run in which no monitor watched the thrusters.
    """
    if "lost_thrusters" not in series:
        return None
    names = series["actuator"].attrs["names"].split(", ")
    time = series["time"].values
    lost = zip(names, series["lost_thrusters"].values.T, strict=True)
    losses = [(name, float(time[signal.argmax()])) for name, signal in lost if signal.any()]
    return sorted(losses, key=lambda loss: loss[1])
