"""What is known of a finished run beside its series, and how it stands in the attributes of a result file."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from undertow.analysis.success import Success
from undertow.analysis.temporal.requirements import Verdict
from undertow.control.supervision.conditions import State
from undertow.control.supervision.transition_log import SupervisorTransition
from undertow.core.json_text import to_json
from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.scenario.provenance import text_hash
from undertow.scenario.reading import dump, parse

_MACHINE = "machine"
_VERSION = "version_"


class RunFacts(NamedTuple):
    """What is known of a finished run beside its series.

    Attributes:
        status: how it ended.
        ended: s; when it failed, else its duration.
        sentence: how it ended, in a sentence.
        title: of the run.
        seed: of everything random.
        steady: metrics over the steady window by name; None where the run did not reach it.
        whole: metrics of the whole run.
        meanings: unit and meaning of each metric, in the order of tables.
        scenario: the scenario with every default filled in; empty for a run of a closed loop made of objects.
        success: whether control succeeded; None without a criterion.
        requirements: verdict by each requirement of the scenario.
        certificate: of the stability proof, see `certify`, with None for numbers that are not finite; None for a law
            without one.
        navigation: what the navigation filter assumed, see `navigation_consistency`, likewise; None without one that
            says.
        transitions: of the supervisor; None where nothing was supervised.
        unactuated: axes of the vehicle that no thruster controls; () for other plants.
        lost_axes: further ones, that none controls any more because thrusters were taken out of use.
        instability: a sentence where a run that did not go well has an unstable loop; not kept in files.
        code: hashes of the user's code files, see `code_hashes`.
        left_to_xla: why the SIMD backend could not be used; "" where it was, or was not asked for.
        versions: of the software, and the class of the machine, see `versions`.
    """

    status: Status
    ended: float
    sentence: str
    title: str
    seed: int
    steady: Mapping[str, Any] | None
    whole: Mapping[str, Any]
    meanings: Mapping[str, Metric]
    scenario: Mapping[str, Any] = MappingProxyType({})
    success: Success | None = None
    requirements: Mapping[str, Verdict] = MappingProxyType({})
    certificate: Mapping[str, Any] | None = None
    navigation: Mapping[str, Any] | None = None
    transitions: Sequence[SupervisorTransition] | None = None
    unactuated: Sequence[str] = ()
    lost_axes: Sequence[str] = ()
    instability: str = ""
    code: str = ""
    left_to_xla: str = ""
    versions: Mapping[str, str] = MappingProxyType({})

    @property
    def faults(self) -> Sequence[Mapping[str, Any]]:
        """Entries of the faults of the scenario."""
        return self.scenario.get("faults", ())

    @property
    def window(self) -> tuple[float, float] | None:
        """Start and stop of the steady window, s; None for a run of a closed loop made of objects."""
        steady = self.scenario.get("steady")
        return None if steady is None else (steady["start"], steady["stop"])

    @property
    def hull(self) -> Sequence[float] | None:
        """Length, width and height of the vehicle, m; None where its file does not say them."""
        return hull_of(self.scenario)

    @property
    def supply(self) -> float | None:
        """Supply voltage of the thrusters, V; None where the scenario has none, or one that changes."""
        plant = self.scenario.get("plant")
        thruster = plant.get("thruster") if isinstance(plant, Mapping) else None
        while isinstance(thruster, Mapping) and "thruster" in thruster:  # of one that wraps another
            thruster = thruster["thruster"]
        supply = thruster.get("supply") if isinstance(thruster, Mapping) else None
        return float(supply) if isinstance(supply, int | float) and math.isfinite(supply) else None

    def attributes(self) -> dict[str, Any]:
        """Attributes of a dataset that say the same."""
        attributes: dict[str, Any] = {"status": self.status.word, "status_sentence": self.sentence, "ended": self.ended}
        if self.certificate is not None:
            attributes["certificate"] = to_json(self.certificate)
        if self.left_to_xla:
            attributes["left_to_xla"] = self.left_to_xla
        attributes["title"] = self.title
        if self.scenario:
            text = dump(self.scenario)
            attributes |= {"scenario": text, "scenario_hash": text_hash(text), "code": self.code}
        attributes |= {"seed": self.seed} | dict(self.versions)
        attributes["metrics"] = to_json({"steady": self.steady, "whole": self.whole})
        attributes["metric_meanings"] = to_json({name: metric._asdict() for name, metric in self.meanings.items()})
        if self.success is not None:
            attributes["success"] = to_json(self.success._asdict())
        if self.requirements:
            attributes["requirements"] = to_json(
                {name: verdict._asdict() for name, verdict in self.requirements.items()}
            )
        if self.unactuated or self.lost_axes:
            attributes["uncontrolled_axes"] = to_json({"unactuated": self.unactuated, "lost": self.lost_axes})
        if self.navigation is not None:
            attributes["navigation"] = to_json(self.navigation)
        if self.transitions is not None:
            attributes["transitions"] = to_json([transition._asdict() for transition in self.transitions])
        return attributes

    def summary(self, further: Mapping[str, Any]) -> str:
        """Contents of metrics.json, with further entries."""
        entries: dict[str, Any] = {"status": self.status.word, "ended": self.ended}
        entries["success"] = None if self.success is None else self.success._asdict()
        if self.requirements:
            entries["requirements"] = {name: verdict._asdict() for name, verdict in self.requirements.items()}
        entries |= {"steady": self.steady, "whole": self.whole} | dict(further) | {"certificate": self.certificate}
        return to_json(entries, indent=2) + "\n"


def facts_from(attributes: Mapping[str, Any]) -> RunFacts:
    """What the attributes of a dataset say of its run.

    Raises:
        KeyError: an attribute is missing that every result has.
        ValueError: an attribute is not as it was written.
        BadInput: the scenario is not as it was written.
    """
    read = lambda name: json.loads(attributes[name]) if name in attributes else None
    metrics = read("metrics") or {}
    success = read("success")
    uncontrolled = read("uncontrolled_axes") or {}
    transitions = read("transitions")
    status, text = _status(attributes["status"]), attributes.get("scenario")
    return RunFacts(
        status=status,
        ended=float(attributes["ended"]),
        sentence=str(attributes.get("status_sentence", status.sentence)),
        title=str(attributes.get("title", "a closed loop")),
        seed=int(attributes.get("seed", 0)),
        steady=metrics.get("steady"),
        whole=metrics.get("whole", {}),
        meanings={name: Metric(**metric) for name, metric in (read("metric_meanings") or {}).items()},
        scenario=parse(text, "scenario", Path(), "scenario").data if text else {},
        success=None if success is None else Success(**success),
        requirements={name: Verdict(**verdict) for name, verdict in (read("requirements") or {}).items()},
        certificate=read("certificate"),
        navigation=read("navigation"),
        transitions=None if transitions is None else [_transition(entry) for entry in transitions],
        unactuated=tuple(uncontrolled.get("unactuated", ())),
        lost_axes=tuple(uncontrolled.get("lost", ())),
        code=str(attributes.get("code", "")),
        left_to_xla=str(attributes.get("left_to_xla", "")),
        versions={name: str(value) for name, value in attributes.items() if _is_version(name)},
    )


def hull_of(scenario: Mapping[str, Any]) -> Sequence[float] | None:
    """Length, width and height of the vehicle of a scenario, m; None where its file does not say them."""
    plant = scenario.get("plant")
    vehicle = plant.get("vehicle") if isinstance(plant, Mapping) else None
    contents = vehicle.get("contents") if isinstance(vehicle, Mapping) else None
    return contents.get("size") if isinstance(contents, Mapping) else None


def _status(word: str) -> Status:
    for status in Status:
        if status.word == word:
            return status
    raise ValueError(f"unknown status {word!r}")


def _transition(entry: Mapping[str, Any]) -> SupervisorTransition:
    return SupervisorTransition(**{**entry, "state": State(entry["state"])})


def _is_version(name: str) -> bool:
    return name.startswith(_VERSION) or name == _MACHINE
