"""The answer of `undertow identify --thruster`: how well thrust is predicted, the numbers, what was not recorded."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from undertow.core.number_text import plain
from undertow.report.answers.identification_answer import in_words, interval_words
from undertow.report.answers.plain_answer import PlainAnswer

_GOOD = 0.05  # share of the largest thrust, up to which an error of prediction is a good one
_CLEARLY = 0.9  # share of the error below which another thruster predicts better than by chance
NAMES = {"curve": "power of the voltage", "motor": "DC motor"}
_LAGS = {"time_constant": "time constant", "rotor_inertia": "rotor inertia"}


def answer_of_thruster(data: Mapping[str, Any], folder: Path) -> PlainAnswer:
    """The answer of an identification of a thruster.

    Args:
        data: contents of identification.json.
        folder: of its files.
    """
    best = data["forms"][0]
    error = best["rms_left_out"]["thrust"]
    share = error / data["largest_thrust"]
    better = [name for name, rms in data["compared"].items() if rms < _CLEARLY * error]
    good = share <= _GOOD and best["converged"] and not better
    rows = sum(bench["rows"] for bench in data["bench"])
    verdict = (
        f"The thruster was identified from {rows} rows: it predicts thrust of rows that were left out within "
        f"{plain(error)} N rms, {plain(100 * share, 2)} % of the largest."
    )
    if better:
        verdict = f"{better[0]} of the catalogue predicts the thrust better than the identified thruster: use that."
    lines = (
        *_full_thrust(data, best),
        *_lag(best),
        *(f"Not identified: {entry['sentence']}" for entry in data["not_identified"]),
        *_unsure(best),
        *(f"On the same rows {name} has an error of {plain(rms)} N rms." for name, rms in data["compared"].items()),
        *_other_forms(data),
        f"Next: put the section of {folder / 'thruster.yaml'} into `plant` of a scenario.",
    )
    return PlainAnswer(good, verdict, lines)


def _full_thrust(data: Mapping[str, Any], form: Mapping[str, Any]) -> Iterator[str]:
    full = form["full_thrust"]
    thrusts = " and ".join(
        f"{interval_words(full[direction])} {words}"
        for direction, words in (("forward", "forward"), ("reverse", "in reverse"))
        if direction in full
    )
    zone = form["parameters"].get("dead_zone")
    ending = f"; the dead zone ends at {interval_words(zone)}" if zone else ""
    yield f"At {plain(data['largest_voltage'])} V its thrust is {thrusts}{ending} (95 % intervals)."


def _lag(form: Mapping[str, Any]) -> Iterator[str]:
    for name, words in _LAGS.items():
        if name in form["parameters"]:
            sentence = f"Its {words} is {interval_words(form['parameters'][name])}"
            yield f"{sentence}; commands arrive {interval_words(form['parameters']['delay'])} late on the bench."


def _unsure(form: Mapping[str, Any]) -> Iterator[str]:
    unsure = [in_words(name) for name, entry in form["parameters"].items() if entry["verdict"] == "unknown"]
    if unsure:
        yield f"The records hardly tell {', '.join(unsure)}: see the intervals."
    if not form["converged"]:
        yield "The estimate had not come to rest: do not trust its intervals."


def _other_forms(data: Mapping[str, Any]) -> Iterator[str]:
    first, *others = data["forms"]
    for other in others:
        error = plain(other["rms_left_out"]["thrust"])
        own, name = NAMES[first["form"]], NAMES[other["form"]]
        yield f"It is described as a {own}; as a {name} its error is {error} N rms, and the file has both."
