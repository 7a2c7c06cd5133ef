"""Whether the inputs of a log can move a vehicle so that it can be identified."""

from collections.abc import Iterator

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.logs.log_signals import Series
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.finding import LogFinding
from undertow.studies.identification.gap_filling import filled, usable_axes

_AT_LIMIT = 0.99
_OFTEN, _NEARLY_ALWAYS = 0.2, 0.9
_SHORTEST, _SHORT = 10.0, 25.0  # s
_LONGEST_INTERVAL = 0.25  # s
_MISSING = 0.2
_ABSURD = 1e9
_WEAK_EFFECT, _MODEST_EFFECT = 1.05, 1.3
_SLOW, _RATHER_SLOW = 0.25, 0.3  # m/s, rad/s; that vehicles work at several times this


def input_findings(inputs: Series, vehicle: HybridVehicle | None, per_axis: bool) -> Iterator[LogFinding]:
    """Inputs that are constant, missing, or at their limits."""
    names = inputs.column_names()
    values = np.asarray(inputs.values, dtype=float).reshape(-1, len(names))
    finite = values[np.isfinite(values).all(axis=1)]
    if len(finite) < 2:
        yield LogFinding(
            "log", "", "refused", "There are no samples of the inputs", "Map the commands of the thrusters"
        )
        return
    span = float(inputs.time[-1] - inputs.time[0])
    if span < _SHORTEST:
        sentence = f"The inputs cover {span:.0f} s; at least {_SHORTEST:.0f} s are needed"
        yield LogFinding("log", "", "refused", sentence, "Take a longer log, or look why they were not logged")
        return
    if np.abs(finite).max() > _ABSURD:
        sentence = f"The inputs have numbers as large as {np.abs(finite).max():.0e}"
        yield LogFinding("log", "", "refused", sentence, "Map the columns that hold the commands")
        return
    is_constant = np.ptp(finite, axis=0) <= 1e-9 * np.maximum(np.abs(finite).max(axis=0), 1e-12)
    if is_constant.all():
        sentence = "No input ever changes: a motion without inputs says nothing about thrusters"
        yield LogFinding("log", "", "refused", sentence, "Take a log in which the vehicle is driven")
        return
    missing = 1 - len(finite) / len(values)
    if missing > _MISSING:
        sentence = f"In {100 * missing:.0f} % of the samples of the inputs there are numbers missing"
        yield LogFinding("input", "", "note", sentence, "They are taken as held from the sample before")
    interval = float(np.median(np.diff(inputs.time)))
    if interval > _LONGEST_INTERVAL:
        sentence = f"The inputs come every {interval:.2f} s; what they were between is not known"
        yield LogFinding("input", "", "note", sentence, "Log them at 10 Hz or more, or each time that they change")
    for name, constant in zip(names, is_constant, strict=True):
        if constant:
            sentence = f"{name} never changes: its gain cannot be known"
            yield LogFinding(
                "input", name, "note", sentence, "Use it in a further dive, or take its gain from the file"
            )
    of_vehicle = None if vehicle is None or per_axis or vehicle.inputs() != len(names) else vehicle
    for name, share in zip(names, _at_limit(finite, of_vehicle), strict=True):
        if share > (_NEARLY_ALWAYS if of_vehicle is None else _OFTEN):
            where = "has its largest size" if of_vehicle is None else "is at its limit"
            sentence = f"{name} {where} {100 * share:.0f} % of the time"
            yield LogFinding("input", name, "note", sentence, "Drive it at several sizes, to see how thrust grows")


def _at_limit(values: np.ndarray, vehicle: HybridVehicle | None) -> np.ndarray:
    """Share of the samples of each input at its limits; without a vehicle, at its largest size."""
    largest = np.abs(values).max(axis=0)
    low, high = (-largest, largest) if vehicle is None else vehicle.thruster.limits()
    low, high = (np.broadcast_to(np.asarray(limit), largest.shape) for limit in (low, high))
    at_limit = (values >= _AT_LIMIT * high) | (values <= _AT_LIMIT * low)
    return (at_limit & (largest > 0)).mean(axis=0)


def axis_findings(dive: Dive, effect: np.ndarray | None) -> Iterator[LogFinding]:
    """Axes that were not measured, along which the vehicle hardly moved, or that the inputs do not move.

    Args:
        dive: on its grid.
        effect: of the inputs on each axis; see `InputGains`.
    """
    if dive.duration < _SHORTEST:
        sentence = f"Inputs and motion overlap for {dive.duration:.0f} s; at least {_SHORTEST:.0f} s are needed"
        yield LogFinding("log", "", "refused", sentence, "Take a longer log, or check that both have the same clock")
        return
    if dive.duration < _SHORT:
        sentence = f"Inputs and motion overlap for {dive.duration:.0f} s only"
        yield LogFinding("log", "", "note", sentence, "Expect wide intervals, or take a longer log")
    whole = filled(dive)
    usable = usable_axes(whole.counts > 0)
    for i, axis in enumerate(BODY_AXES):
        of_axis = usable[:, i]
        unit = "m/s" if i < 3 else "rad/s"
        if of_axis.mean() < 0.05:
            needed = "a velocity or a position" if i < 3 else "an attitude, and an angular velocity if there is one"
            sentence = f"The motion in {axis} was not measured"
            yield LogFinding("axis", axis, "refused", sentence, f"Log {needed}")
            continue
        speed = float(np.percentile(np.abs(whole.values[of_axis, 7 + i]), 95))
        strength = np.inf if effect is None or not np.isfinite(effect[i]) else float(effect[i])
        more = f"Take a dive with inputs that push in {axis}, to and fro, at full and at half size"
        if strength < _WEAK_EFFECT:
            share = 100 * max(0.0, 1 - 1 / strength**2)
            sentence = f"The inputs explain {share:.0f} % of the acceleration in {axis} that nothing else explains"
            yield LogFinding("axis", axis, "refused", sentence, more)
        elif speed < _SLOW or (speed < _RATHER_SLOW and strength < _MODEST_EFFECT):
            sentence = f"In {axis} the vehicle hardly moves: for 95 % of the time slower than {speed:.2f} {unit}"
            yield LogFinding("axis", axis, "refused", sentence, more)
