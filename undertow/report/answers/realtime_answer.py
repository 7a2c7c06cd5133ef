"""The answer of `undertow run`: whether the vehicle held its reference by its own measurement, and late steps."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from undertow.analysis.metrics import of_group, output_groups
from undertow.logs.log import Log
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity

_NORMAL = ("INIT", "READY", "ACTIVE")  # states of the supervisor of which nothing is to be said


def answer_of_realtime_run(
    log: Log | None, units: Sequence[str], criterion: Mapping[str, float], statistics: Mapping[str, Any]
) -> PlainAnswer:
    """The measured errors of the second half beside what the scenario judges by, inputs, steps, and the supervisor.

    Args:
        log: of the run; None where it was not read.
        units: of the outputs.
        criterion: metric -> what it must stay below, of the scenario.
        statistics: of the loop, as in statistics.json.
    """
    errors = {} if log is None else _measured_errors(log, units)
    judged = {key: rms < criterion[key] for key, (rms, _, _) in errors.items() if key in criterion}
    good = all(judged.values()) if judged else None
    lines = (*_error_lines(errors, units, criterion), *_inputs(log), _steps(statistics), *_supervision(statistics))
    return PlainAnswer(good, _verdict(good, log, statistics), lines)


def _verdict(good: bool | None, log: Log | None, statistics: Mapping[str, Any]) -> str:
    ending = f"Ended: {statistics['ended']}. The last output is the safe one."
    if good is None or log is None:
        return ending
    start, stop = _second_half(log)
    held = "held" if good else "did not hold"
    return f"The vehicle {held} its reference from {start:.3g} to {stop:.3g} s, by its own measurement. {ending}"


def _second_half(log: Log) -> tuple[float, float]:
    """When the transition from where the vehicle was found should be over, and the end, s."""
    time = log["measured_position"].time
    return float((time[0] + time[-1]) / 2), float(time[-1])


def _measured_errors(log: Log, units: Sequence[str]) -> dict[str, tuple[float, float, str]]:
    """Metric -> rms per axis of the second half, the largest distance there, and the unit; of what was measured."""
    measured, reference = log["measured_position"], log["reference"]
    error = reference.values - measured.values
    turns = [i for i, unit in enumerate(units) if unit == "rad"]
    error[:, turns] = (error[:, turns] + np.pi) % (2 * np.pi) - np.pi
    error = error[measured.time >= _second_half(log)[0]]
    errors = {}
    for group, (unit, places) in output_groups(units).items():
        rows = error[np.isfinite(error[:, places]).all(axis=1)][:, places]
        if len(rows):
            largest = np.sqrt((rows**2).sum(axis=1)).max()
            errors[of_group(group, "error_rms")] = float(np.sqrt((rows**2).mean())), float(largest), unit
    return errors


def _error_lines(
    errors: Mapping[str, tuple[float, float, str]], units: Sequence[str], criterion: Mapping[str, float]
) -> Iterator[str]:
    for key, (rms, largest, unit) in errors.items():
        name = key.removesuffix("_rms").replace("_", " ").capitalize()
        limit = f" (limit {quantity(criterion[key], unit)})" if key in criterion else ""
        off = f"{quantity(rms, unit)} from the reference{limit}, rms per axis; at most {quantity(largest, unit)}"
        yield f"{name}: {off}."
    if not errors and units:
        yield "How far it was from its reference is not known: nothing was measured, or the log is too long."


def _inputs(log: Log | None) -> Iterator[str]:
    """The largest command."""
    if log is None:
        return
    commands = log["commanded_input"]
    sizes = np.abs(commands.values[np.isfinite(commands.values).all(axis=1)])
    if sizes.size:
        yield f"Commands up to {quantity(float(sizes.max()), commands.unit)}."


def _steps(statistics: Mapping[str, Any]) -> str:
    """How many steps were taken, and what went wrong with their times."""
    rate = 1 / statistics["sampling_time"]
    wrong = {
        "commands after their deadline": statistics["overruns"],
        "periods without a command": statistics["missed"],
        "steps without a new measurement": statistics["stale"],
    }
    said = ", ".join(f"{number} {what}" for what, number in wrong.items() if number) or "none late"
    return f"{statistics['steps']} steps at {rate:.4g} Hz; {said}."


def _supervision(statistics: Mapping[str, Any]) -> Iterator[str]:
    """The last change of state that is not one of a normal run."""
    changes = [one for one in statistics.get("transitions", ()) if one["state"] not in _NORMAL]
    if changes:
        last = changes[-1]
        times = "once" if len(changes) == 1 else f"{len(changes)} times"
        yield f"The supervisor intervened {times}, last with {last['state']} at {quantity(last['time'], 's')}."
