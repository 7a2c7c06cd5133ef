"""What stands in the columns of a store: names of dimensions, meanings, units, codes."""

from typing import Any, NamedTuple

import numpy as np

from undertow.analysis.meanings import MEANINGS
from undertow.core.status import Status
from undertow.loop.record import dimensions
from undertow.scenario.build import Built
from undertow.studies.campaign.task import REFUSED
from undertow.studies.campaign.trials import Trials


class Label(NamedTuple):
    """Of one array of the store."""

    dimensions: tuple[str, ...]
    attributes: dict[str, Any]


def labels(several: Trials) -> dict[str, Label]:
    """Labels of all columns, by name."""
    of_trials = {f"vary:{key}": _varied(key, entries) for key, entries in several.columns()}
    of_trials["seed"] = {"long_name": "seed of everything random"}
    of_trials["status"] = _codes()
    of_trials["ended"] = {"long_name": "when the run ended", "units": "s"}
    of_trials |= {name: {"long_name": one.meaning, "units": one.unit or "1"} for name, one in MEANINGS.items()}
    found = {name: Label(("trial",), attributes) for name, attributes in of_trials.items()}
    for name in several.campaign.series.signals if several.campaign.series else ():
        found[f"series:{name}"] = Label(("trial", *dimensions(name)), {"long_name": name.replace("_", " ")})
    return found


def coordinates(several: Trials, built: Built) -> dict[str, tuple[np.ndarray, dict[str, Any]]]:
    """Values and attributes along the dimensions of series; none without series.

    Args:
        several: the trials.
        built: one of them.
    """
    asked, loop, plant = several.campaign.series, built.scenario.loop, built.closed_loop.plant
    if asked is None:
        return {}
    every = round(asked.every / loop.dt)
    time = every * np.arange(round(loop.duration / loop.dt) // every + 1) * loop.dt
    return {
        "time": (time, {"long_name": "time", "units": "s"}),
        "axis": (np.array(plant.outputs), {"long_name": "output", "unit_of_each": ", ".join(plant.output_units)}),
        "input": (np.arange(1, plant.inputs() + 1), {"long_name": "input"}),
    }


def _varied(key: str, entries: dict[str, Any] | None) -> dict[str, Any]:
    """Of what differs between trials; numbers that stand for a choice say which."""
    said = {"long_name": key}
    return said if entries is None else said | {"choices": list(entries)}


def _codes() -> dict[str, Any]:
    """Codes and their words as the CF conventions have them."""
    words = {REFUSED: "refused"} | {int(status): status.word for status in Status}
    return {
        "long_name": "how the run ended",
        "flag_values": list(words),
        "flag_meanings": " ".join(words.values()),
    }
