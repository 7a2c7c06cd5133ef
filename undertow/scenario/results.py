"""Results of a finished run: status, metrics, and a self-describing dataset."""

import json
import math
from typing import Any, NamedTuple

import xarray as xr

from undertow.analysis.certificate import certify
from undertow.analysis.metrics import measure, results
from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop
from undertow.loop.outcome import Outcome
from undertow.loop.record import to_dataset
from undertow.power.ledger import closure
from undertow.scenario.provenance import checksum, content_hash, versions


class Labelled(NamedTuple):
    """One finished run."""

    status: Status
    steady: dict[str, Any] | None  # metrics over the steady window; None when the run ended early
    whole: dict[str, Any]
    dataset: xr.Dataset


def label(
    loop: ClosedLoop, outcome: Outcome, window: tuple[float, float], dt: float, attributes: dict[str, Any]
) -> Labelled:
    """Compute the metrics of a run and make its dataset.

    Args:
        loop: the closed loop.
        outcome: its outcome; accumulated metrics, if any, are the steady metrics.
        window: start and stop of the steady metrics, s.
        dt: sampling time, s.
        attributes: further attributes of the dataset.
    """
    status, ended = Status(int(outcome.status)), float(outcome.ended)
    counted = {} if rules(loop) is None else {"rules": rules(loop)}
    covered = status is Status.OK and window[0] < ended
    dataset = to_dataset(outcome, loop.plant, loop.controller)
    over = lambda start, stop: measure(outcome, start, stop) | closure(dataset, start, stop) | counted
    # A run ended by an invalid command has no input at that instant.
    last = ended - dt / 2 if status is Status.COMMAND_NOT_FINITE else ended
    steady, whole = over(*window) if covered else None, over(0.0, last)
    if steady is not None and outcome.accumulated:
        steady |= results(outcome.accumulated[0])
    certified = certify(dataset, loop.controller, window, dt)
    if certified is not None:
        dataset = dataset.assign(certified.signals)
        dataset.attrs["certificate"] = to_json(certified.summary)
    dataset.attrs |= attributes | versions()
    dataset.attrs["metrics"] = to_json({"steady": steady, "whole": whole})
    dataset.attrs["content_hash"] = content_hash(dataset)
    dataset.attrs["checksum"] = checksum(dataset)
    return Labelled(status, steady, whole, dataset)


def rules(loop: ClosedLoop) -> int | None:
    """Number of fuzzy rules per axis; None for a controller without a fuzzy system."""
    fuzzy = getattr(loop.controller, "fuzzy", None)
    return None if fuzzy is None else fuzzy.rules


def metrics_text(dataset: xr.Dataset, further: dict[str, Any] | None = None) -> str:
    """Contents of metrics.json for a run, with further entries."""
    ending = {"status": dataset.attrs["status"], "ended": dataset.attrs["ended"]}
    metrics = json.loads(dataset.attrs["metrics"]) | (further or {})
    found = ending | metrics | {"certificate": certificate_of(dataset)}
    return to_json(found, indent=2) + "\n"


def certificate_of(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Certificate of a run from its attributes; None for a controller without one, and in older files."""
    return json.loads(dataset.attrs["certificate"]) if "certificate" in dataset.attrs else None


def to_json(value: Any, indent: int | None = None) -> str:
    """Standard JSON: numbers that are not finite become null."""
    return json.dumps(_finite(value), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
