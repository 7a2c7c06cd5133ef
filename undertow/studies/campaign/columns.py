"""What stands in the columns of a store: names of dimensions, meanings, units, codes."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.meanings import MEANINGS
from undertow.core.status import Status
from undertow.loop import record
from undertow.scenario.build import Built
from undertow.studies.campaign.task import REFUSED
from undertow.studies.campaign.trials import Trials

# Codes of the column `status` and their words.
ENDINGS = {REFUSED: "refused"} | {int(status): status.word for status in Status}


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
        found[f"series:{name}"] = Label(("trial", *record.dimensions(name)), {"long_name": name.replace("_", " ")})
    return found


def coordinates(several: Trials, built: Built) -> dict[str, xr.Variable]:
    """What stands along the dimensions of series; nothing without series.

    Args:
        several: the trials.
        built: one of them.
    """
    asked, loop = several.campaign.series, built.scenario.loop
    if asked is None:
        return {}
    every = round(asked.every / loop.dt)
    time = every * np.arange(round(loop.duration / loop.dt) // every + 1) * loop.dt
    return record.coordinates(time, built.closed_loop.plant)


def _varied(key: str, entries: dict[str, Any] | None) -> dict[str, Any]:
    """Of what differs between trials; numbers that stand for a choice say which."""
    said = {"long_name": key}
    return said if entries is None else said | {"choices": list(entries)}


def _codes() -> dict[str, Any]:
    """Codes and their words as the CF conventions have them."""
    return {
        "long_name": "how the run ended",
        "flag_values": list(ENDINGS),
        "flag_meanings": " ".join(ENDINGS.values()),
    }
