"""A run as a labelled dataset: names, units and meanings of what was recorded."""

import numpy as np
import xarray as xr

from undertow.core.contracts import AbstractPlant
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import Outcome


def to_dataset(outcome: Outcome, loop: ClosedLoop) -> xr.Dataset:
    """Recorded series with coordinates `time` (s), `axis` (names of the outputs) and `actuator` (numbers from 1).

    Attribute `names` of `actuator` names the inputs. Attribute `controller_axes` of `axis` names the axes of the
    uncertainty and of the controller's signals where these are not the outputs: surge, sway, ... of a law in body axes.
    """
    variables = {
        name: series(dimensions(signal), np.asarray(outcome.signals[name]), *meaning(signal, loop.plant))
        for name, signal in loop.signals().items()
    }
    status = Status(int(outcome.status))
    coords = coordinates(np.asarray(outcome.time), loop.plant)
    coords["actuator"].attrs["names"] = ", ".join(input_names(loop.plant))
    if loop.controller.model.coordinates.axes:
        coords["axis"].attrs["controller_axes"] = ", ".join(loop.controller.model.coordinates.axes)
    return xr.Dataset(
        variables,
        coords=coords,
        attrs={"status": status.word, "status_sentence": outcome.sentence(), "ended": float(outcome.ended)},
    )


def coordinates(time: np.ndarray, plant: AbstractPlant) -> dict[str, xr.Variable]:
    """Coordinates of the dimensions `time` (s), `axis` (names of the outputs) and `actuator` (numbers from 1)."""
    axis = series(("axis",), np.array(plant.outputs), "output")
    axis.attrs["unit_of_each"] = ", ".join(plant.output_units)
    return {
        "time": series(("time",), time, "time", "s"),
        "axis": axis,
        "actuator": series(("actuator",), np.arange(1, plant.inputs() + 1), "input"),
    }


def input_names(plant: AbstractPlant) -> tuple[str, ...]:
    """Names of the inputs: those of the thrusters of a vehicle, else `input 1`, `input 2`, ..."""
    vehicle = getattr(plant, "vehicle", None)
    numbered = tuple(f"input {number}" for number in range(1, plant.inputs() + 1))
    return numbered if vehicle is None else vehicle.thruster_names()


def dimensions(signal: Signal) -> tuple[str, ...]:
    """Names of the dimensions of a series."""
    return ("time", *signal.dimensions)


def meaning(signal: Signal, plant: AbstractPlant) -> tuple[str, str]:
    """Meaning of a signal and its unit; the units of all axes where they differ."""
    return signal.meaning, signal.unit_for(plant.output_units, plant.input_unit)


def series(dims: tuple[str, ...], values: np.ndarray, meaning: str, unit: str | None = None) -> xr.Variable:
    """One variable of a dataset; as a plain array, for which xarray does not import dask."""
    units = {} if unit is None else {"units": unit}
    return xr.Variable(dims, values, {"long_name": meaning, **units}, fastpath=True)
