"""Results of a finished run: status, metrics, and a self-describing dataset."""

import json
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import xarray as xr

from undertow.analysis.certify import certify
from undertow.analysis.metrics import Gathered, meanings, measure, results
from undertow.analysis.navigation_consistency import navigation_consistency
from undertow.analysis.success import Success, judged
from undertow.analysis.temporal.requirements import Requirement, contiguous, needed_signals
from undertow.analysis.temporal.requirements import judged as required
from undertow.core.contracts import AbstractController
from undertow.core.metric import AbstractMetric, Metric
from undertow.core.status import Status
from undertow.faults.of_computation import law_of_computed
from undertow.loop.closed_loop import ClosedLoop
from undertow.loop.dataset import to_dataset
from undertow.loop.outcome import Outcome
from undertow.power.ledger import closure
from undertow.scenario.foreign_code import changed
from undertow.scenario.provenance import checksum, claims, content_hash, versions
from undertow.scenario.reading import parse
from undertow.supervision.conditions import State
from undertow.supervision.supervised_controller import state_in, unsupervised
from undertow.supervision.transition_log import Transition, transitions


class Measuring(NamedTuple):
    """How a run is measured.

    Attributes:
        window: start and stop of the steady metrics, s.
        dt: sampling time, s.
        own: metrics of the scenario's own.
        criterion: of success.
        gathered: what has gathered the steady metrics along the run; () where the record is what counts.
        requirements: on the run.
        record: time between records, s.
        duration: asked for, s.
    """

    window: tuple[float, float]
    dt: float
    own: tuple[AbstractMetric, ...] = ()
    criterion: Mapping[str, float] = MappingProxyType({})
    gathered: Gathered = ()
    requirements: tuple[Requirement, ...] = ()
    record: float = math.nan
    duration: float = math.nan


class Labelled(NamedTuple):
    """One finished run."""

    status: Status
    steady: dict[str, Any] | None  # metrics over the steady window; None when the run ended early
    whole: dict[str, Any]
    success: Success | None
    dataset: xr.Dataset


def label(loop: ClosedLoop, outcome: Outcome, how: Measuring, attributes: dict[str, Any]) -> Labelled:
    """Compute the metrics of a run and make its dataset.

    Args:
        loop: the closed loop.
        outcome: its outcome.
        how: settings of the measurement.
        attributes: further attributes of the dataset.
    """
    status, ended = Status(int(outcome.status)), float(outcome.ended)
    law = law_of(loop)
    counted = {} if rules(law) is None else {"rules": rules(law)}
    covered = status is Status.OK and how.window[0] < ended
    dataset = to_dataset(outcome, loop)

    def over(start: float, stop: float) -> dict[str, Any]:
        residuals = closure(dataset, start, stop)
        return measure(outcome, loop.plant, start, stop, how.own) | residuals | counted

    # A run ended by an invalid command has no input at that instant.
    last = ended - how.dt / 2 if status is Status.COMMAND_NOT_FINITE else ended
    steady, whole = over(*how.window) if covered else None, over(0.0, last)
    if steady is not None and how.gathered:
        steady |= results(how.gathered, outcome.accumulated)
    lasted_but_unseen = status is Status.OK and not covered
    success = None if lasted_but_unseen else judged(how.criterion, steady)
    certified = certify(dataset, law, how.window, how.dt)
    if certified is not None:
        dataset = dataset.assign(certified.signals)
        dataset.attrs["certificate"] = to_json(certified.summary)
    dataset.attrs |= attributes | versions()
    known = meanings(loop, how.own)
    dataset.attrs["metrics"] = to_json({"steady": steady, "whole": whole})
    shown = {*whole, *how.criterion}  # a run that failed at once lacks metrics that its criterion names
    dataset.attrs["metric_meanings"] = to_json({n: one._asdict() for n, one in known.items() if n in shown})
    if success is not None:
        dataset.attrs["success"] = to_json(success._asdict())
    if how.requirements:
        kept = contiguous(outcome.signals, needed_signals(how.requirements))
        found = required(how.requirements, kept, how.record, steady or {}, int(status), ended, how.duration)
        dataset.attrs["requirements"] = to_json({name: one._asdict() for name, one in found.items()})
    if (navigated := navigation_consistency(loop, dataset, steady)) is not None:
        dataset.attrs["navigation"] = to_json(navigated)
    if (supervised := state_in(outcome.final[1])) is not None:
        dataset.attrs["transitions"] = to_json([one._asdict() for one in transitions(supervised.log)])
    dataset.attrs["content_hash"] = content_hash(dataset)
    dataset.attrs["checksum"] = checksum(dataset)
    return Labelled(status, steady, whole, success, dataset)


def law_of(loop: ClosedLoop) -> AbstractController:
    """The control law of a loop, without supervision and faults of its computer."""
    return unsupervised(law_of_computed(loop.controller))


def rules(law: AbstractController) -> int | None:
    """Number of fuzzy rules per axis; None for a controller without a fuzzy system."""
    fuzzy = getattr(law, "fuzzy", None)
    return None if fuzzy is None else fuzzy.rules


def metrics_text(dataset: xr.Dataset, further: Mapping[str, Any]) -> str:
    """Contents of metrics.json for a run, with further entries."""
    ending = {"status": dataset.attrs["status"], "ended": dataset.attrs["ended"]}
    metrics = json.loads(dataset.attrs["metrics"]) | further
    success = json.loads(dataset.attrs.get("success", "null"))
    kept = {"requirements": requirements_of(dataset)} if "requirements" in dataset.attrs else {}
    found = ending | {"success": success} | kept | metrics | {"certificate": certificate_of(dataset)}
    return to_json(found, indent=2) + "\n"


def metrics_of(dataset: xr.Dataset) -> dict[str, Metric]:
    """Unit and meaning of the metrics of a run, by name, in the order of tables."""
    return {name: Metric(**one) for name, one in json.loads(dataset.attrs["metric_meanings"]).items()}


def requirements_of(dataset: xr.Dataset) -> dict[str, Any]:
    """Robustness of a run by requirement, and whether it holds, from its attributes; {} without requirements."""
    return json.loads(dataset.attrs.get("requirements", "{}"))


def certificate_of(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Certificate of a run from its attributes; None for a controller without one, and in older files."""
    return json.loads(dataset.attrs["certificate"]) if "certificate" in dataset.attrs else None


def navigation_of(dataset: xr.Dataset) -> dict[str, Any] | None:
    """What a navigation filter assumed, and whether it was as accurate; None without one that says, as `observer`."""
    return json.loads(dataset.attrs["navigation"]) if "navigation" in dataset.attrs else None


def transitions_of(dataset: xr.Dataset) -> list[Transition] | None:
    """Transitions of the supervisor of a run from its attributes; None where nothing was supervised."""
    if "transitions" not in dataset.attrs:
        return None
    return [Transition(**one | {"state": State(one["state"])}) for one in json.loads(dataset.attrs["transitions"])]


def faults_of(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Entries of the faults of a run, from its scenario; none for a run that was made from objects."""
    if not dataset.attrs.get("scenario"):
        return []
    return list(parse(dataset.attrs["scenario"], "scenario", Path(), "scenario").data.get("faults", ()))


def losses_of(dataset: xr.Dataset) -> list[tuple[str, float]] | None:
    """Name of each thruster that was taken out of use, and the time of the first record of that, s, in its order.

    None for a run in which no monitor watched the thrusters.
    """
    if "lost_thrusters" not in dataset:
        return None
    names, time = dataset["actuator"].attrs["names"].split(", "), dataset["time"].values
    lost = zip(names, dataset["lost_thrusters"].values.T, strict=True)
    losses = [(name, float(time[series.argmax()])) for name, series in lost if series.any()]
    return sorted(losses, key=lambda loss: loss[1])


def window_of(dataset: xr.Dataset) -> tuple[float, float] | None:
    """Start and stop of the steady window of a run, s, from its scenario; None for a run that was made from objects."""
    if not dataset.attrs.get("scenario"):
        return None
    steady = parse(dataset.attrs["scenario"], "scenario", Path(), "scenario").data["steady"]
    return steady["start"], steady["stop"]


def to_json(value: Any, indent: int | None = None) -> str:
    """Standard JSON: numbers that are not finite become null."""
    return json.dumps(_finite(value), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


_LEFT_OUT = "left_out"  # attribute of a result: series that the run had and the file has not
_SHOWN = 3  # of what differs


def shortened(dataset: xr.Dataset, kept: Collection[str]) -> xr.Dataset:
    """A result with some of its series only, to be written compressed; no number is changed.

    Its content hash stays that of the whole run, so that a repetition is compared with all of it.

    Args:
        dataset: of the run.
        kept: names of series; those that the run has not are ignored.
    """
    left_out = sorted(str(name) for name in dataset.data_vars if name not in kept)
    short = dataset.drop_vars(left_out).copy()
    for variable in short.variables.values():
        if variable.dtype.kind in "fi":
            variable.encoding = {"zlib": True, "shuffle": True, "complevel": 4}
    short.attrs[_LEFT_OUT] = ", ".join(left_out)
    short.attrs["checksum"] = checksum(short)
    return short


class Repetition(NamedTuple):
    """A run compared with the result file it was repeated from."""

    equal: bool
    explained: bool  # whether other versions or changed code explain a difference
    sentence: str


def compare(path: Path, repeated: xr.Dataset) -> Repetition:
    """Compare a run with the result file at `path`, whose scenario it used and whose checksum, if any, is correct."""
    with xr.open_dataset(path, engine="netcdf4") as earlier:
        before, held = dict(earlier.attrs), claims(earlier)
    now, left_out = claims(repeated), set(before.get(_LEFT_OUT, "").split(", "))
    differing = [name for name, claim in held.items() if now.get(name) != claim]
    added = sorted(set(now) - set(held) - left_out)
    if _LEFT_OUT in before and not differing and not added and before["content_hash"] != repeated.attrs["content_hash"]:
        differing = ["series that it has left out"]
    code = _code(path, before)
    if not differing:
        which = f"in all its contents; new since then: {_listed(added)}" if added else _short(repeated)
        though = f", although {code}" if code else ""
        unknown = "" if "checksum" in before else "; it has no checksum that could reveal changes to the file"
        return Repetition(True, True, f"{path.name} was repeated bit for bit {which}{though}{unknown}")
    others = [_differences(before, repeated.attrs), code, f"one without {_listed(added)}" if added else ""]
    reasons = ", ".join(filter(None, others))
    why = f"; other versions: {reasons}" if reasons else ", with the same versions"
    return Repetition(
        False, bool(reasons), f"{path.name} was not repeated bit for bit{why}. Differences: {_listed(differing)}"
    )


def _short(repeated: xr.Dataset) -> str:
    return f"(content hash {repeated.attrs['content_hash'][:12]})"


def _listed(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if names[_SHOWN:] else "")


def _code(path: Path, before: dict) -> str:
    """Code files that have changed."""
    scenario = parse(str(before.get("scenario") or "{}"), path.name, path.resolve().parent)
    files = changed(before.get("code"), scenario.data, scenario.folder)
    return ", ".join(f"{file} has changed" for file in files)


def _differences(before: dict, now: dict) -> str:
    names = sorted(name for name in {*before, *now} if name.startswith("version_") or name == "machine")
    changed = [name for name in names if before.get(name) != now.get(name)]
    return ", ".join(
        f"{name.removeprefix('version_')} {before.get(name)} then, {now.get(name)} now" for name in changed
    )
