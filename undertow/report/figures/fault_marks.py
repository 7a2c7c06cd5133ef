"""Where the faults of a run begin, and when its supervisor took thrusters out of use, as marks in its figures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from undertow.report.figures.multiples import Mark
from undertow.report.signal_names import input_names, lost_thrusters

_ONSET, _FOUND = (0, (1, 1.5)), (0, (4, 2))  # dashes


def fault_marks(run: xr.Dataset, faults: Sequence[Mapping[str, Any]] = ()) -> list[Mark]:
    """A mark at the onset of each fault of the scenario, and one where a thruster was taken out of use.

    Faults of one onset share a mark; one whose onset was sampled has none.

    Args:
        run: recorded series.
        faults: entries of the scenario.
    """
    short = lambda name: name.partition(" ")[0]
    names = [short(name) for name in input_names(run)]
    words: dict[float, list[str]] = {}
    for fault in faults:
        if isinstance(fault["onset"], int | float):
            words.setdefault(float(fault["onset"]), []).append(f"{_target(fault, names)} {fault['mode']}")
    end = float(np.nanmax(run["time"].values, initial=0.0))
    onsets = [
        Mark(onset, ", ".join(descriptions), _ONSET, before=True)
        for onset, descriptions in words.items()
        if onset <= end
    ]
    losses = [Mark(time, f"{short(name)} out of use", _FOUND, before=False) for name, time in lost_thrusters(run) or ()]
    return onsets + losses


def _target(fault: Mapping[str, Any], names: list[str]) -> str:
    """`T2` for a thruster; other targets as the scenario names them."""
    number = fault.get("number", "")
    if fault["target"] == "thruster" and isinstance(number, int):
        return names[number - 1]
    return f"{fault['target']} {number}".rstrip()
