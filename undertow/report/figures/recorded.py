"""Signals of a dataset as curves, with names and units."""

import re

import numpy as np
import xarray as xr

from undertow.core.number_text import display_units
from undertow.report.figures.multiples import Curve
from undertow.report.figures.style import Look, power

# Signals in the units of the outputs.
_OF_OUTPUTS = ("position", "reference", "error", "measured_position")


def in_degrees(run: xr.Dataset) -> xr.Dataset:
    """A run as people read it: outputs that are angles in degrees, as in tables. Files hold radians."""
    units = run["axis"].attrs["unit_of_each"].split(", ")
    factors, shown_units = zip(*(display_units(1.0, unit) for unit in units), strict=True)
    scaled = {name: run[name].copy(data=run[name].values * factors) for name in _OF_OUTPUTS}
    axis = run["axis"].copy()
    axis.attrs["unit_of_each"] = ", ".join(shown_units)
    return run.assign(scaled).assign_coords(axis=axis)


def places(run: xr.Dataset) -> list[str]:
    """Label of the position on each axis: a position or an angle."""
    return [re.sub("^position, (rad|deg)$", r"angle, \1", label) for label in per_axis(run, "position")]


def per_axis(run: xr.Dataset, quantity: str, rate: str = "") -> list[str]:
    """Label of a quantity on each axis with its unit, divided by `rate`: "", "/s" or "/s^2"."""
    units = run["axis"].attrs["unit_of_each"].split(", ")
    return [f"{quantity}, {power(unit + rate)}" for unit in units]


def per_input(run: xr.Dataset, quantity: str) -> list[str]:
    """Label of a quantity on each input with its unit."""
    return [f"{quantity}, {run['input'].attrs['units']}"] * run.sizes["actuator"]


def curve(run: xr.Dataset, name: str, signal: str, look: Look) -> Curve:
    """A signal of a dataset, up to the end of the run."""
    is_valid = run["time"].values <= run.attrs.get("ended", np.inf)
    return Curve(name, run["time"].values[is_valid], run[signal].values[is_valid], look)


def difference(run: xr.Dataset, name: str, signal: str, other: str, look: Look) -> Curve:
    """One signal less another."""
    first, second = curve(run, name, signal, look), curve(run, name, other, look)
    return first._replace(values=first.values - second.values)


def magnitude(curve: Curve) -> Curve:
    """Its absolute value."""
    return curve._replace(values=np.abs(curve.values))


def settled(run: xr.Dataset) -> float:
    """Time, s, after which the y axes fit the values: the first twentieth of a run is start-up."""
    return float(run["time"].values[-1]) / 20
