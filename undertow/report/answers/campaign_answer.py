"""The answer of a campaign: how many trials went well, the spread of the errors, and what they depend on."""

from collections.abc import Iterator, Mapping
from typing import Any

from undertow.analysis.metrics import titled_name
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.studies.campaign.store_results import Results

_STRONG = 0.3  # rank correlation from which on an input is worth naming
_MOST = 3  # inputs, and combinations, that are named
_VERDICTS = {
    "holds": "holds",
    "fails": "is violated",
    "open": "is not decided by these trials (increase `trials` and use `--resume`)",
}


def answer_of_campaign(results: Results, summary: Mapping[str, Any]) -> PlainAnswer:
    """The answer of a campaign.

    Args:
        results: of its trials.
        summary: contents of summary.json.
    """
    good = _good(summary)
    lines = (
        *_requirements(results, summary),
        *_errors(results, summary),
        *_causes(summary),
        *_remarks(summary),
        *_worst(summary),
    )
    return PlainAnswer(good, _verdict(summary), lines)


def _count(summary: Mapping[str, Any], key: str) -> int:
    return sum(combination["success"][key] for combination in summary["combinations"])


def _named(combination: Mapping[str, Any]) -> str:
    """The swept values of a combination; empty where nothing is swept."""
    return ", ".join(f"{key} {value}" for key, value in combination["values"].items())


def _verdicts(summary: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Every requirement with the combination that it is about."""
    return [
        (_named(combination), requirement)
        for combination in summary["combinations"]
        for requirement in combination["requirements"]
    ]


def _good(summary: Mapping[str, Any]) -> bool | None:
    verdicts = [requirement["verdict"] for _, requirement in _verdicts(summary)]
    if verdicts:
        return False if "fails" in verdicts else None if "open" in verdicts else True
    if not set(summary["status"]) <= {"completed"}:
        return False
    within, missed = _count(summary, "within"), _count(summary, "not_within")
    return None if not within + missed else not missed


def _verdict(summary: Mapping[str, Any]) -> str:
    done, completed = summary["done"], summary["status"].get("completed", 0)
    ended = f"{completed} of {done} trials completed" if completed < done else f"All {done} trials completed"
    others = [f"{number} {word.replace('_', ' ')}" for word, number in summary["status"].items() if word != "completed"]
    ended += f" ({', '.join(others)})" if others else ""
    within, missed = _count(summary, "within"), _count(summary, "not_within")
    if not within + missed:
        return f"{ended}."
    return f"{ended}; {within} of {within + missed} kept to the criterion of success."


def _requirements(results: Results, summary: Mapping[str, Any]) -> Iterator[str]:
    """The verdict on each requirement; the worst of many combinations."""
    order = {"fails": 0, "open": 1}
    verdicts = sorted(_verdicts(summary), key=lambda pair: (order.get(pair[1]["verdict"], 2), pair[1]["kept"]))
    for where, requirement in verdicts[:_MOST]:
        low, high = requirement["interval"]
        of = f" ({where})" if where else ""
        name, formula = requirement["metric"], requirement["formula"]
        bound = f"< {quantity(requirement['below'], results.unit(name))}" if formula is None else f"({formula})"
        yield (
            f"Requirement {name} {bound}{of} {_VERDICTS[requirement['verdict']]}: "
            f"{quantity(requirement['kept'], '')} of the trials keep it, "
            f"95 % interval {100 * low:.1f} to {100 * high:.1f} %; {quantity(requirement['share'], '')} are required."
        )
    if (more := len(verdicts) - _MOST) > 0:
        yield f"{more} further verdicts are in the table of `--details` and on the page; these are the worst."


def _errors(results: Results, summary: Mapping[str, Any]) -> Iterator[str]:
    """Median, and what 95 % of the trials stay below, of the tracking errors."""
    for combination in summary["combinations"][:_MOST]:
        where, parts = _named(combination), []
        for name in results.tracking:
            if name in combination["metrics"]:
                _, median, high = combination["metrics"][name].values()
                unit = results.unit(name)
                parts.append(f"{titled_name(name)} {quantity(median, unit)} ({quantity(high, unit)} in 95 %)")
        if parts:
            yield f"{f'{where}: ' if where else ''}Median {'; '.join(parts)}."
    if (more := len(summary["combinations"]) - _MOST) > 0:
        yield f"{more} further combinations are in the table of `--details` and on the page."


def _causes(summary: Mapping[str, Any]) -> Iterator[str]:
    """Inputs that the errors depend on most."""
    strongest = sorted(
        (
            (abs(correlation), key, metric, correlation)
            for key, by_metric in summary["sensitivity"].items()
            for metric, correlation in by_metric.items()
            if metric in ("position_rms", "attitude_rms", "tracking_rms")
        ),
        reverse=True,
    )
    named: dict[str, str] = {}
    for size, key, metric, correlation in strongest:
        if size >= _STRONG and key not in named and len(named) < _MOST:
            named[key] = f"`{key}` ({'more' if correlation > 0 else 'less'} {titled_name(metric)}, {correlation:+.2f})"
    if named:
        count = len(summary["combinations"])
        mean = f" (mean over the {count} combinations)" if count > 1 else ""
        yield f"What matters most, by rank correlation{mean}: {', '.join(named.values())}."


def _remarks(summary: Mapping[str, Any]) -> Iterator[str]:
    """What controllers know of a plant that varies, why trials did not run, and what ran slowly."""
    for invalid in summary["invalid"][:_MOST]:
        yield f"{invalid['trials']} trials are invalid and did not run: {invalid['why']}."
    if summary["nominal_model"]:
        yield summary["nominal_model"]
    if slow := by_xla(summary):
        yield slow


def by_xla(summary: Mapping[str, Any]) -> str:
    """A sentence about trials that used the XLA backend; empty where none did."""
    if not summary["by_xla"]:
        return ""
    consequence = "which is slower, and a single run repeats such a trial only up to rounding"
    return (
        f"{summary['by_xla']} trials used the XLA backend, {consequence}. `undertow simulate` of one states the reason."
    )


def _worst(summary: Mapping[str, Any]) -> Iterator[str]:
    if summary["worst"] and summary["done"] > 1:
        worst = summary["worst"][0]
        yield f"The worst trial is number {worst}: worst/trial-{worst:07d}.yaml repeats it with `undertow simulate`."
