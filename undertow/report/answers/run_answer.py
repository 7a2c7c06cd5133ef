"""The answer of one run."""

from collections.abc import Iterator

import numpy as np

from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import LEAST, quantity
from undertow.report.signal_names import lost_thrusters
from undertow.scenario.results.run_facts import RunFacts
from undertow.scenario.results.run_result import RunRecord

_LIMITED = "What limits it:"
_SOME = 0.01  # share of the time at the limits of the inputs that is worth saying
_ERRORS = ("position_rms", "attitude_rms", "tracking_rms")
_MOST = 0.6  # share of a squared error from which on its axis is named
_AT_LIMIT = 0.99  # of the supply, from which on an input is at its limit
_MEASURED = 0.5  # share of the error that the measurement explains, from which on it is said to limit the run


def answer_of_run(run: RunRecord) -> PlainAnswer:
    """The errors and what they are judged by, how far off at most, what it took, and what limits a finished run."""
    facts = run.facts
    good = facts.success.within if facts.success is not None else None if facts.status is Status.OK else False
    lines = (*_criterion(run), *_largest(facts), *_effort(facts), *_failures(run), *_limits(run))
    return PlainAnswer(good, _verdict(facts, good), lines)


def _verdict(facts: RunFacts, good: bool | None) -> str:
    if facts.status is not Status.OK:
        ending = facts.status.word.replace("_", " ")
        return f"It did not go well: {ending} after {quantity(facts.ended, 's')}. {facts.sentence}"
    if good is None:
        return "The run reached its end. The scenario does not say what counts as success."
    span = "" if facts.window is None else " from {:g} to {:g} s".format(*facts.window)
    return f"It {'went' if good else 'did not go'} well{span}."


def _criterion(run: RunRecord) -> Iterator[str]:
    """The metrics that success is judged by, beside what they must stay below; what exceeds it first, and where."""
    facts = run.facts
    success, steady = facts.success, facts.steady
    if success is None or steady is None:
        return
    keys = sorted(success.criterion, key=lambda key: key not in success.exceeded)
    judged = "; ".join(_judged(facts.meanings[key], steady.get(key), success.criterion[key], key) for key in keys)
    yield f"{judged[:1].upper()}{judged[1:]}."
    for key in success.exceeded:
        unit = facts.meanings[key].unit
        worst = _worst_axis(run, unit) if key in _ERRORS else None
        if worst is not None:
            axis, rms = worst
            uncontrolled = axis in (*facts.unactuated, *facts.lost_axes)
            why = ", which no thruster controls" if uncontrolled else ""
            yield f"Most of the {facts.meanings[key].named(key)}, is in {axis}{why}: {quantity(rms, unit)} rms."


def _worst_axis(run: RunRecord, unit: str) -> tuple[str, float] | None:
    """The axis of a unit that has most of the squared error in the steady window, and its rms; None where none has."""
    series = run.series
    units = np.array(series["axis"].attrs["unit_of_each"].split(", "))
    of_unit = np.flatnonzero(units == unit)
    if len(of_unit) < 2:
        return None
    squares = (series["error"].values[np.ix_(_in_window(run), of_unit)] ** 2).mean(axis=0)
    worst = int(np.argmax(squares))
    if not squares[worst] > _MOST * squares.sum():
        return None
    return str(series["axis"].values[of_unit[worst]]), float(np.sqrt(squares[worst]))


def _judged(metric: Metric, value: float | None, most: float, key: str) -> str:
    """A metric beside what it must stay below."""
    found = "not defined" if value is None else quantity(value, metric.unit)
    return f"{metric.named(key)} {found} (limit {quantity(most, metric.unit)})"


def _largest(facts: RunFacts) -> Iterator[str]:
    """How far off the vehicle was at most; in the steady window, without the way there."""
    named = {"position_max": "in position", "attitude_max": "in attitude", "tracking_max": "of the reference"}
    metrics, when = (facts.whole, " in the whole run") if facts.steady is None else (facts.steady, "")
    off = [
        f"{quantity(metrics[key], facts.meanings[key].unit)} {words}"
        for key, words in named.items()
        if metrics.get(key) is not None
    ]
    if off:
        yield f"Largest error{when}: {' and '.join(off)}."


def _effort(facts: RunFacts) -> Iterator[str]:
    """What the inputs gave, how often they were at their limits, and the energy."""
    whole = facts.whole
    if whole.get("input_peak") is None:
        return
    share = whole.get("saturated_fraction") or 0.0
    reached = facts.supply is not None and whole["input_peak"] > _AT_LIMIT * facts.supply
    seldom = "at the limits for an instant" if reached else "never at the limits"
    limits = seldom if not share else f"at the limits for {quantity(share, '')} of the time"
    of_supply = "" if facts.supply is None else f" of {quantity(facts.supply, 'V')}"
    peak = quantity(whole["input_peak"], facts.meanings["input_peak"].unit)
    energy = whole.get("energy")
    mean = "" if not energy else f"; {quantity(energy, 'J')}, {quantity(energy / facts.ended, 'W')} on average"
    yield f"Inputs in the whole run: up to {peak}{of_supply}, {limits}{mean}."


def _failures(run: RunRecord) -> Iterator[str]:
    """Thrusters that were found to have failed, and what nothing controls without them."""
    for name, time in lost_thrusters(run.series) or ():
        yield f"{name} was found to have failed and was taken out of use at {quantity(time, 's')}."
    if run.facts.lost_axes:
        yield f"Without it no thruster controls {' and '.join(run.facts.lost_axes)}."


def _limits(run: RunRecord) -> Iterator[str]:
    """What limits the run: its loop, the inputs, the measurement, or loads that are not compensated."""
    steady = run.facts.steady
    if run.facts.instability:
        yield f"{_LIMITED} {run.facts.instability}. Other gains help: `undertow tune` finds some."
        return
    if steady is None:
        return
    if (steady.get("saturated_fraction") or 0.0) >= _SOME:
        share = quantity(steady["saturated_fraction"], "")
        yield (
            f"{_LIMITED} the inputs, which are at their limits for {share} of that time: reference and "
            "disturbances take more than they have."
        )
        return
    hypotheses = (run.facts.certificate or {}).get("hypotheses", ())
    unmoved = any(one["name"] == "rank" and one["steady"] is not None and one["steady"] < 1 for one in hypotheses)
    if unmoved and run.facts.success is not None and not run.facts.success.within:
        yield f"{_LIMITED} there are axes along which no input acts{_named_axes(run.facts)}."
        return
    error, measured = steady.get("position_rms"), _measurement_error(run)
    if error is None or error < LEAST["m"]:
        return
    if measured >= _MEASURED * error:
        yield f"{_LIMITED} the measurement, whose position is {quantity(measured, 'm')} off (rms per axis)."
        return
    load, left = steady.get("position_uncertainty_rms"), steady.get("position_estimation_rms")
    if load and left is not None and left < load:
        yield (
            f"{_LIMITED} {quantity(left / load, '')} of the loads is not compensated. They change too fast for the "
            "gains or for the navigation filter, or the loop swings by itself: `undertow analyze` tells."
        )


def _named_axes(facts: RunFacts) -> str:
    return f": {', '.join(facts.unactuated)}" if facts.unactuated else ""


def _measurement_error(run: RunRecord) -> float:
    """What the measured positions are off in the steady window, m, rms per axis."""
    series = run.series
    metres = [unit == "m" for unit in series["axis"].attrs["unit_of_each"].split(", ")]
    off = (series["measured_position"] - series["position"]).values[np.ix_(_in_window(run), metres)]
    return float(np.sqrt(np.mean(off**2))) if off.size else 0.0


def _in_window(run: RunRecord) -> np.ndarray:
    """Which records are in the steady window."""
    time, window = run.series["time"].values, run.facts.window
    return np.ones(len(time), bool) if window is None else (time >= window[0]) & (time <= window[1])
