"""Running a scenario: outcome, metrics and a dataset that can repeat itself."""

import functools
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from undertow.analysis.metrics import measure
from undertow.core.status import Status
from undertow.loop import continuous, sampled
from undertow.loop.outcome import Outcome
from undertow.loop.record import to_dataset
from undertow.scenario.build import Built, build
from undertow.scenario.provenance import content_hash, text_hash, versions
from undertow.scenario.reading import Text, dump


class Executed(NamedTuple):
    """One run of a scenario."""

    built: Built
    outcome: Outcome
    status: Status
    steady: dict[str, Any] | None  # metrics over the steady window; None when the run did not last
    whole: dict[str, Any]
    dataset: xr.Dataset


def execute(source: Text | Mapping[str, Any] | Built) -> Executed:
    """Run a scenario.

    Args:
        source: a scenario, read, as data or built.

    Raises:
        BadInput: anything wrong with it.
    """
    built = source if isinstance(source, Built) else build(source)
    outcome = jax.block_until_ready(_run(built))
    status = Status(int(outcome.status))
    window, rules = built.scenario.steady, _rules(built)
    covered = status is Status.OK and window.start < float(outcome.ended)
    steady = measure(outcome, window.start, window.stop) | rules if covered else None
    whole = measure(outcome, 0.0, float(outcome.ended)) | rules
    dataset = _labelled(built, outcome, steady, whole)
    return Executed(built, outcome, status, steady, whole, dataset)


def save(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as netCDF; the file appears whole or not at all.

    Raises:
        OSError: the folder cannot be written.
    """
    handle, temporary = tempfile.mkstemp(suffix=".nc.tmp", dir=path.parent)
    os.close(handle)
    try:
        dataset.to_netcdf(temporary, engine="netcdf4")
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _run(built: Built) -> Outcome:
    scenario = built.scenario
    settings, start = scenario.loop, scenario.initial
    place = {
        key: None if value is None else np.asarray(value, dtype=float)
        for key, value in (("position", start.position), ("velocity", start.velocity))
    }
    common = {"duration": settings.duration, "key": jax.random.PRNGKey(scenario.seed), **place}
    if settings.kind == "continuous":
        run = functools.partial(
            continuous.simulate, record_step=settings.record, rtol=settings.rtol, atol=settings.atol
        )
    else:
        record_every = round(settings.record / settings.dt)
        run = functools.partial(
            sampled.simulate,
            dt=settings.dt,
            record_every=record_every,
            method=settings.method,
            substeps=settings.substeps,
        )
    return run(built.closed_loop, **common)


def _rules(built: Built) -> dict[str, int]:
    fuzzy = getattr(built.closed_loop.controller, "fuzzy", None)
    return {} if fuzzy is None else {"rules": fuzzy.rules}


def _labelled(built: Built, outcome: Outcome, steady: dict | None, whole: dict) -> xr.Dataset:
    text = dump(built.resolved)
    dataset = to_dataset(outcome, built.closed_loop.plant)
    dataset.attrs |= {
        "title": built.scenario.description or "a closed loop run by undertow",
        "scenario": text,
        "scenario_hash": text_hash(text),
        "seed": built.scenario.seed,
        "metrics": json.dumps({"steady": steady, "whole": whole}),
        "content_hash": content_hash(dataset),
        **versions(),
    }
    return dataset
