"""The answer of a comparison: how every candidate did, what is established, and whether it was fair."""

import math
from collections.abc import Iterator

from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.studies.comparison.equal_budgets import GAINS_KEPT
from undertow.studies.comparison.findings import Findings
from undertow.studies.comparison.sentences import metric_name, needed_pairs
from undertow.studies.comparison.tuning_note import takes_own_path, tells_of_search

# Candidates that have a line of their own; the table has all.
_MOST = 4
# Of these, the first that a comparison has ranks its candidates.
_ERRORS = ("tracking_rms", "position_rms", "attitude_rms")


def answer_of_comparison(findings: Findings, noun: str) -> PlainAnswer:
    """The answer of a comparison.

    Args:
        findings: of it.
        noun: what is compared: `controller`, `scenario` or `variant`.
    """
    failing = [name for name in findings.names if findings.completed(name) < findings.trials]
    lines = (*_candidates(findings), *_established(findings), *_known(findings), *_fairness(findings, noun))
    return PlainAnswer(_good(findings, failing), _verdict(findings, failing, noun), lines)


def _good(findings: Findings, failing: list[str]) -> bool | None:
    if failing:
        return False
    judged = [counts for counts in findings.successes.values() if counts[1]]
    return None if not judged else all(within == trials for within, trials in judged)


def _verdict(findings: Findings, failing: list[str], noun: str) -> str:
    trials = "one trial" if findings.trials == 1 else f"{findings.trials} trials with the same seeds"
    subject = f"{len(findings.names)} {noun}s in {trials} of each"
    if failing:
        return f"{subject}: {', '.join(failing)} did not complete all of them."
    missed = [name for name, (within, judged) in findings.successes.items() if within < judged]
    if missed:
        counts = ", ".join(f"{name} in {_times(findings, name)}" for name in missed)
        return f"{subject}: all completed, but not all kept to the criterion of success: {counts}."
    kept = " within the criterion of success" if any(judged for _, judged in findings.successes.values()) else ""
    return f"{subject}: all completed{kept}."


def _times(findings: Findings, name: str) -> str:
    within, judged = findings.successes[name]
    return f"{within} of {judged}"


def _known(findings: Findings) -> Iterator[str]:
    """What controllers know of a plant that varies."""
    if findings.nominal_model:
        yield findings.nominal_model


def _error(findings: Findings) -> str:
    """The metric that ranks; empty without one."""
    return next((metric for metric in _ERRORS if metric in findings.medians), "")


def _ranked(findings: Findings) -> list[str]:
    """Candidates, those that completed most first, then those with the smallest error."""
    medians = findings.medians.get(_error(findings), {})

    def rank(name: str) -> tuple[int, float]:
        value = medians[name].value if name in medians else math.nan
        return -findings.completed(name), math.inf if math.isnan(value) else value

    return sorted(findings.names, key=rank)


def _candidates(findings: Findings) -> Iterator[str]:
    """Median errors and effort of the best candidates."""
    ranked = _ranked(findings)
    for name in ranked[:_MOST]:
        parts = [
            f"{metric_name(metric)} {_value(findings, metric, name)}"
            for metric in (*_ERRORS, "input_rms")
            if metric in findings.medians and findings.medians[metric][name].trials
        ]
        completed = findings.completed(name)
        of = "" if completed == findings.trials else f" (completed {completed} of {findings.trials})"
        yield f"{name}{of}: {', '.join(parts) or 'no trial was completed'}."
    if len(ranked) > _MOST:
        yield f"Behind them: {', '.join(ranked[_MOST:])}."


def _value(findings: Findings, metric: str, name: str) -> str:
    # The units of a comparison leave out the 1 of plain numbers.
    return quantity(findings.medians[metric][name].value, findings.units[metric] or "1")


def _established(findings: Findings) -> Iterator[str]:
    """What statistics say of the best candidate against the others."""
    metric, best = _error(findings), _ranked(findings)[0]
    if not metric or len(findings.names) < 2:
        return
    if findings.all_equal:
        yield "Nothing in the scenario is random, so that one trial tells all: differences are what they are."
        return
    differences = [difference for difference in findings.differences if difference.metric == metric]
    of_rival = {
        difference.baseline if difference.candidate == best else difference.candidate: difference
        for difference in differences
        if best in (difference.candidate, difference.baseline)
    }
    pairs, needed = max((difference.pairs for difference in of_rival.values()), default=0), needed_pairs(findings)
    if pairs < needed:
        yield (
            f"{pairs} trials that both completed are too few to establish a difference: it takes {needed} at least "
            f"(`--trials {max(20, needed)}`)."
        )
        return
    # One that failed too often to be compared has been named in the verdict.
    compared = {rival: difference for rival, difference in of_rival.items() if difference.pairs >= needed}
    beaten = [
        rival
        for rival, difference in compared.items()
        if difference.established and (difference.median < 0) == (difference.candidate == best)
    ]
    undecided = [rival for rival in compared if rival not in beaten]
    if beaten:
        yield f"The {metric_name(metric)} of {best} is smaller than that of {', '.join(beaten)}: established."
    if undecided:
        yield f"Between {best} and {', '.join(undecided)} no difference in {metric_name(metric)} is established."


def _fairness(findings: Findings, noun: str) -> Iterator[str]:
    """Whether gains were searched for: without, a comparison of controllers says little. Which laws are at a loss."""
    if noun != "controller":
        return
    searched = [name for name, sentence in findings.tuning.items() if tells_of_search(sentence)]
    if not searched:
        yield "No gains were searched for: `--tune 60` gives every controller the same budget before it is compared."
    else:
        for name, sentence in findings.tuning.items():
            if name not in searched:
                yield f"{name}: {sentence}."
            elif GAINS_KEPT in sentence:
                yield f"{name} has its gains of before: {GAINS_KEPT}."
    for name, sentence in findings.tuning.items():
        if takes_own_path(sentence):
            yield (
                f"{name} commands the inputs in a way of its own. The other laws use the curve, the dead zone and the "
                "limits of the thrusters: derive from AbstractAccelerationLaw for the same "
                "(docs/how-to/your-own-controller.md)."
            )
