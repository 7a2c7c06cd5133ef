"""A run as a labelled dataset: names, units, and how it came about."""

import numpy as np
import xarray as xr

from undertow.core.contracts import AbstractController, AbstractPlant
from undertow.core.status import Status
from undertow.loop.outcome import Outcome

# Signal -> (dimension, meaning, unit of a plain axis; rates of angles follow from the axis).
_MEANINGS = {
    "position": ("axis", "position", ""),
    "velocity": ("axis", "velocity", "/s"),
    "measured_position": ("axis", "position as the controller was told", ""),
    "measured_velocity": ("axis", "velocity as the controller was told", "/s"),
    "target": ("axis", "wanted position", ""),
    "error": ("axis", "tracking error x_d - x", ""),
    "uncertainty": ("axis", "lumped uncertainty d = x_ddot - F - G V, measured", "/s^2"),
    "estimate": ("axis", "estimate d_hat", "/s^2"),
    "robust": ("axis", "robust term u_r", "/s^2"),
    "modelling_error": ("axis", "modelling error eps = x_hat_dot - x_dot", "/s"),
    "predicted_position": ("axis", "position of the identification model", ""),
    "predicted_velocity": ("axis", "velocity of the identification model", "/s"),
    "voltage": ("input", "input applied", None),
    "command": ("input", "input asked for", None),
    "power": ("input", "electrical power realization", "W"),
    "saturated": ("input", "1 where the input is at its limit", "1"),
    "bad_readings": (None, "readings so far that were no numbers: left out, or replaced by what the law expects", "1"),
    "weights_peak": (None, "largest |theta|", "m/s^2, rad/s^2"),
    "weights": ("rule", "weights theta of the fuzzy rules", "/s^2"),
}


def to_dataset(outcome: Outcome, plant: AbstractPlant, controller: AbstractController) -> xr.Dataset:
    """Recorded series with coordinates `time` (s), `axis` (names of the outputs) and `input` (numbers from 1)."""
    variables = {
        name: series(dimensions(name), np.asarray(getattr(outcome.signals, name)), *meaning(name, plant))
        for name in _MEANINGS
    }
    columns = plant.columns() | controller.columns()
    for name, values in outcome.signals.diagnostics.items():
        variables[name] = series(("time",), np.asarray(values), *columns[name])
    status = Status(int(outcome.status))
    return xr.Dataset(
        variables,
        coords=coordinates(np.asarray(outcome.time), plant),
        attrs={"status": status.word, "status_sentence": outcome.sentence(), "ended": float(outcome.ended)},
    )


def coordinates(time: np.ndarray, plant: AbstractPlant) -> dict[str, xr.Variable]:
    """What stands along the dimensions `time` (s), `axis` (names of the outputs) and `input` (numbers from 1)."""
    axis = series(("axis",), np.array(plant.outputs), "output")
    axis.attrs["unit_of_each"] = ", ".join(plant.output_units)
    return {
        "time": series(("time",), time, "time", "s"),
        "axis": axis,
        "input": series(("input",), np.arange(1, plant.inputs() + 1), "input"),
    }


def dimensions(name: str) -> tuple[str, ...]:
    """Names of the dimensions of a signal."""
    along = _MEANINGS[name][0]
    return {None: ("time",), "rule": ("time", "axis", "rule")}.get(along, ("time", along))


def meaning(name: str, plant: AbstractPlant) -> tuple[str, str]:
    """What a signal is, and its unit; the units of all axes where they differ."""
    _, words, rate = _MEANINGS[name]
    if "axis" in dimensions(name):
        return words, ", ".join(f"{unit}{rate}" for unit in dict.fromkeys(plant.output_units))
    return words, rate or plant.input_unit


def series(dims: tuple[str, ...], values: np.ndarray, meaning: str, unit: str | None = None) -> xr.Variable:
    """One variable of a dataset; as a plain array, without xarray asking (and importing) dask whether it is one."""
    units = {} if unit is None else {"units": unit}
    return xr.Variable(dims, values, {"long_name": meaning, **units}, fastpath=True)
