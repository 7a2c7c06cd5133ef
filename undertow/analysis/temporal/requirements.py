"""Requirements of a run: bounds of metrics and temporal formulas, judged by the signed distance to their violation."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from undertow.analysis.temporal.formula import Arithmetic, Formula
from undertow.analysis.temporal.parsing import Entries, FormulaNames, parse_formula
from undertow.core.errors import BadInput, did_you_mean, error_location
from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.simulation.loop.closed_loop import ClosedLoop

# Robustness of a run that failed at its end; one that failed earlier has less, down to twice that.
_FAILED = -1.0


class Requirement(NamedTuple):
    """A requirement on one run: either a formula on its records, or a bound of a metric of its steady window.

    Attributes:
        name: of the requirement; that of the metric for a bound.
        formula: None for a bound.
        below: upper bound of the metric, in its unit.
    """

    name: str
    formula: Formula | None = None
    below: float = math.inf


class Verdict(NamedTuple):
    """How a run keeps a requirement.

    Attributes:
        robustness: what is left to the bound, as a share of the bound; negative where the requirement is violated.
        holds: whether it is kept.
    """

    robustness: float
    holds: bool


def known_of(loop: ClosedLoop) -> FormulaNames:
    """Signals that a formula on a loop may name: numbers, and lists over outputs or inputs."""
    plant = loop.plant
    names = {"axis": tuple(plant.outputs), "actuator": tuple(map(str, range(plant.inputs())))}
    entries: dict[str, Entries] = {}
    for name, signal in loop.signals().items():
        if not signal.dimensions:
            entries[name] = Entries(())
        elif len(signal.dimensions) == 1 and signal.dimensions[0] in names:
            entries[name] = Entries(names[signal.dimensions[0]])
    return FormulaNames(entries, plant.output_units)


def requirements_of(
    formulas: Mapping[str, str],
    bounds: Mapping[str, float],
    loop: ClosedLoop,
    metrics: Mapping[str, Metric],
    duration: float,
) -> tuple[Requirement, ...]:
    """Requirements from their texts and bounds, by name.

    Args:
        formulas: name -> text of a formula.
        bounds: metric -> its upper bound.
        loop: whose runs they are about.
        metrics: that such a run may have.
        duration: of a run, s.

    Raises:
        BadInput: no formula, or about what is no signal or no metric, or about nothing before the end of the run.
    """
    requirements = []
    names = known_of(loop)
    for name, text in formulas.items():
        with error_location(f"{name}.formula"):
            formula = parse_formula(text, names)
            if formula.horizon() > duration:
                raise BadInput("", f"begin before the end of the run ({duration:g} s)", f"{formula.horizon():g} s")
        requirements.append(Requirement(name, formula))
    for name, below in bounds.items():
        if name not in metrics:
            raise BadInput(name, "be a metric of this plant, or have a `formula`", hint=did_you_mean(name, metrics))
        requirements.append(Requirement(name, below=below))
    return tuple(requirements)


def evaluate_requirements(
    requirements: Sequence[Requirement],
    signals: Mapping[str, Any],
    period: float,
    metrics: Mapping[str, Any],
    status: int,
    ended: float,
    duration: float,
) -> dict[str, Verdict]:
    """Verdict of a run by each requirement.

    A run that failed keeps none: its robustness is at most -1, less the share of the duration that it lacks.

    Args:
        requirements: what is required.
        signals: recorded signals of the run, time first; those that formulas name.
        period: between records, s.
        metrics: of the steady window.
        status: a Status code.
        ended: s.
        duration: asked for, s.
    """
    verdicts = {}
    for requirement in requirements:
        if requirement.formula is not None:
            value = float(requirement.formula.robustness(signals, period)[0])
        else:
            value = bound_robustness(float(metrics.get(requirement.name, math.nan)), requirement.below)
        if math.isnan(value):  # a signal that is not defined
            value = _FAILED
        if status != int(Status.OK):
            value = min(value, _FAILED - max(0.0, 1.0 - ended / duration))
        verdicts[requirement.name] = Verdict(value, value > 0)
    return verdicts


def bound_robustness(value: float, below: float) -> float:
    """Robustness of a bound of a metric; that of a metric which is not defined in a run is -1."""
    return (below - value) / (abs(below) or 1.0) if math.isfinite(value) else _FAILED


def needed_signals(requirements: Sequence[Requirement]) -> tuple[str, ...]:
    """Signals that the formulas name."""
    formulas = [requirement.formula for requirement in requirements if requirement.formula is not None]
    return tuple(sorted({name for formula in formulas for name in formula.names()}))


def contiguous(signals: Mapping[str, Any], names: Sequence[str]) -> dict[str, np.ndarray]:
    """Signals in one layout of memory, so that sums over them have the same bits however the run was computed."""
    return {name: np.ascontiguousarray(signals[name], dtype=float) for name in names}


def smooth_robustness(
    requirements: Sequence[Requirement], by: Arithmetic
) -> Callable[[Mapping[str, Any], float], Any] | None:
    """Function of signals and period that gives the smallest robustness of all formulas; None with other bounds."""
    formulas = [requirement.formula for requirement in requirements]
    if not formulas or any(formula is None for formula in formulas):
        return None

    def smallest(signals: Mapping[str, Any], period: float) -> Any:
        robustness = by.nothing
        for formula in formulas:
            if formula is not None:
                robustness = by.minimum(by.numbers.asarray(robustness), formula.robustness(signals, period, by)[0])
        return robustness

    return smallest
