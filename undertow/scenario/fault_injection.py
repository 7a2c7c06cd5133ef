"""A closed loop with the faults of a scenario."""

import dataclasses
import inspect
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from undertow.control.navigation.from_sensors import SensorNavigation
from undertow.core import catalogue
from undertow.core.errors import BadInput, error_location, known_key
from undertow.physics.faults.injected import Faults, InputFault, PlantFault, QuantityFault
from undertow.physics.faults.kinds import FaultKind, check_pair
from undertow.physics.faults.mode import AbstractFault
from undertow.physics.faults.occurrence import Occurrence
from undertow.physics.faults.of_computation import ComputationFault, computed, law_of_computed
from undertow.physics.faults.of_sensors import SensorFault, SensorFaults
from undertow.physics.faults.targets import FaultTarget, checked_number, named, targets_of
from undertow.scenario import factory
from undertow.scenario.schema import Fault
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import input_names

# Words for keys of a fault that other programs use.
_OTHER_WORDS: dict[str, str] = dict.fromkeys(("start", "start_time", "begin", "time", "from", "t"), "onset")
_OTHER_WORDS |= dict.fromkeys(("kind", "type", "fault"), "mode")
_OTHER_WORDS |= dict.fromkeys(("size", "value", "amount"), "severity")
_OTHER_WORDS |= {"length": "duration", "lasts": "duration", "where": "target", "thruster": "number"}


def with_faults(
    loop: ClosedLoop,
    entries: Sequence[Fault],
    folder: Path = Path(),
    sampling_time: float = 1e-3,
    made: Mapping[int, AbstractFault] = MappingProxyType({}),
) -> tuple[ClosedLoop, list[dict[str, Any]]]:
    """The loop with faults, and their entries with every default filled in; itself without any.

    Args:
        loop: closed loop without faults.
        entries: of the key `faults`.
        folder: of relative file names.
        sampling_time: of the loop, s.
        made: modes that are objects already, by the place of their entry.

    Raises:
        BadInput: an entry is invalid; key names start at the entry.
    """
    if not entries:
        return loop, []
    known = targets_of(loop.plant, loop.navigation)
    names = input_names(loop.plant) if "thruster" in known else ()
    groups: dict[str, list[Any]] = {"quantity": [], "input": [], "plant": [], "sensor": [], "computation": []}
    entries_of: dict[str, list[int]] = {name: [] for name in groups}
    resolved = []
    for place, entry in enumerate(entries):
        with error_location(f"[{place}]"):
            target, number = named(entry.target, entry.number, known, names)
            number = checked_number(target, number)
            fault, options = made.get(place), {}
            if fault is None:
                fault, options = _made(entry, folder, sampling_time)
            kind = check_pair(target, entry.mode, fault)
            occurrence = _occurrence(entry, kind, target, fault)
            sampled = sum(one.sampled is not None for one in groups["input"]) if number == "random" else None
            group = "input" if target.role in ("thruster", "bus") else target.role
            groups[group] += _placed(target, number, entry, fault, occurrence, sampled)
            entries_of[group].append(place)
            resolved.append(_resolved(entry, kind, target, number, occurrence) | options)
    of_sensors, of_computer = tuple(groups["sensor"]), tuple(groups["computation"])
    navigation: Any = loop.navigation
    if of_sensors:
        navigation = dataclasses.replace(navigation, faults=SensorFaults(of_sensors))
    elsewhere = tuple(one.occurrence for one in (*of_sensors, *of_computer))
    first, second, third = (tuple(groups[name]) for name in ("quantity", "input", "plant"))
    in_order = (*entries_of["quantity"], *entries_of["input"], *entries_of["plant"])
    faults = Faults(first, second, third, elsewhere, loop.plant.inputs(), in_order)
    controller = computed(loop.controller, of_computer)
    return dataclasses.replace(loop, navigation=navigation, controller=controller, faults=faults), resolved


def without_faults(loop: ClosedLoop) -> ClosedLoop:
    """The loop as it is before any fault."""
    if loop.faults is None:
        return loop
    navigation, controller = loop.navigation, loop.controller
    if isinstance(navigation, SensorNavigation):
        navigation = dataclasses.replace(navigation, faults=None)
    return dataclasses.replace(loop, navigation=navigation, controller=law_of_computed(controller), faults=None)


def _made(entry: Fault, folder: Path, sampling_time: float) -> tuple[AbstractFault, dict[str, Any]]:
    """The mode of an entry, and its options with their defaults."""
    options = dict(entry.model_extra or {})
    function = catalogue.find("faults", entry.mode, folder, "mode")
    longest = entry.severity if entry.severity is not None else _default_severity(function)
    context = {"sampling_time": sampling_time, "longest": float(np.max(longest))}
    own = [name for name in inspect.signature(function).parameters if name not in context]
    for key in options:
        if key not in own:
            other = _OTHER_WORDS.get(str(key).lower())
            hint = f"Did you mean `{other}`?" if other else known_key(str(key), [*type(entry).model_fields, *own])
            raise BadInput(str(key), f"be a key of a fault, or an option of `{entry.mode}`", "unknown", hint=hint)
    with error_location(written=lambda key: "mode" if key == "kind" else key):
        fault, described = factory.make("faults", {"kind": entry.mode, **options}, folder, (), context)
    name = described.pop("kind")
    return fault, {"mode": name} | {key: value for key, value in described.items() if key not in context}


def _default_severity(function: Any) -> float:
    made = inspect.signature(function).return_annotation
    return made.severity.default if isinstance(made, type) and issubclass(made, AbstractFault) else 0.0


def _occurrence(entry: Fault, kind: FaultKind, target: FaultTarget, fault: AbstractFault) -> Occurrence:
    """When and how severe, checked against the range of the severity."""
    onset = _range("onset", 0.0 if entry.onset is None else entry.onset, 0.0, math.inf, "s")
    duration = entry.duration
    if duration is None:
        duration = getattr(fault, "default_duration", math.inf)
    if kind.default is None or kind.lowest is None or kind.highest is None:
        if entry.severity is not None:
            must = f"be left out: `{kind.mode}` of `{kind.target}` has none"
            raise BadInput("severity", must, entry.severity)
        severity = (1.0, 1.0)
    else:
        given = kind.default if entry.severity is None else entry.severity
        severity = _range("severity", given, kind.lowest, kind.highest, kind.unit)
    if target.role in ("sensor", "computation"):
        for name, (low, high) in (("onset", onset), ("severity", severity)):
            if low != high:
                raise BadInput(name, f"be one number for `{target.name}`", f"[{low:g}, {high:g}]")
    return Occurrence(onset, duration, severity)


def _range(name: str, given: float | list[float], lowest: float, highest: float, unit: str) -> tuple[float, float]:
    """Range of a value that is one number, or sampled between two."""
    ends = given if isinstance(given, list) else [given, given]
    if len(ends) != 2 or not ends[0] <= ends[1]:
        raise BadInput(name, "be a number, or [lowest, highest] for one that is sampled", str(given))
    for end in ends:
        if not lowest <= end <= highest:
            bounds = f"from {lowest:g} to {highest:g}" if highest < math.inf else f"{lowest:g} or more"
            raise BadInput(name, f"be {bounds} {unit}".rstrip(), f"{end:g}")
    return float(ends[0]), float(ends[1])


def _placed(
    target: FaultTarget, number: int | str | None, entry: Fault, fault: Any, occurrence: Occurrence, sampled: int | None
) -> list[Any]:
    """The fault at its target; of a sensor that the filter has several times, at each of them unless one is named."""
    if entry.announced and target.role not in ("thruster", "bus"):
        raise BadInput("announced", f"be false for `{target.name}`", "true", hint="Only thrusters and the bus announce")
    if entry.axis is not None and target.role not in ("quantity", "sensor"):
        raise BadInput("axis", f"be left out for `{target.name}`", entry.axis)
    if target.role == "plant":
        return [PlantFault(fault, occurrence)]
    if target.role == "computation":
        return [ComputationFault(fault, occurrence)]
    chosen = np.ones(target.width)
    if target.role in ("thruster", "bus"):
        if target.role == "thruster":
            chosen = np.zeros(target.width) if number == "random" else np.eye(target.width)[int(number or 1) - 1]
        return [InputFault(fault, occurrence, entry.announced, chosen, sampled)]
    if entry.axis is not None:
        if not 1 <= entry.axis <= target.width:
            raise BadInput("axis", f"be from 1 to {target.width} for `{target.name}`", entry.axis)
        chosen = np.eye(target.width)[entry.axis - 1]
    if target.role == "quantity":
        return [QuantityFault(fault, occurrence, target.name, chosen)]
    places = target.places if number is None else (target.places[int(number) - 1],)
    turn = np.where(np.isin(np.arange(target.width), target.angles), 2 * np.pi, 0.0)
    return [SensorFault(fault, occurrence, place, chosen, turn) for place in places]


def _resolved(
    entry: Fault, kind: FaultKind, target: FaultTarget, number: int | str | None, occurrence: Occurrence
) -> dict[str, Any]:
    """The entry as a scenario has it, with every default filled in."""
    ends = lambda pair: float(pair[0]) if float(pair[0]) == float(pair[1]) else [float(one) for one in pair]
    duration = float(occurrence.duration)
    found: dict[str, Any] = {"target": target.name, "mode": entry.mode}
    found |= {} if number is None else {"number": number}
    found |= {} if entry.axis is None else {"axis": entry.axis}
    found |= {} if kind.default is None else {"severity": ends(np.asarray(occurrence.severity))}
    found["onset"] = ends(np.asarray(occurrence.onset))
    found |= {"duration": duration} if math.isfinite(duration) else {}
    return found | ({"announced": True} if entry.announced else {})
