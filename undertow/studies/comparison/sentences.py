"""The findings of a comparison in sentences: failures, and what is established between every two candidates."""

import math
from collections.abc import Callable

from undertow.analysis.metrics import titled_name
from undertow.core.number_text import display_units
from undertow.studies.comparison.findings import COMPLETED, Findings
from undertow.studies.comparison.paired import FEWEST, LEVEL, Completion, PairedDifference
from undertow.studies.comparison.pareto import Front

_MANIFOLD = 10.0  # times the baseline, from which on percent say little
HOW = (
    "A difference counts as established where the two-sided Wilcoxon signed-rank test is below 5 % with Holm's "
    "correction for all tests of this comparison, and the 95 % bootstrap interval of the median difference excludes "
    "zero. A pair is a trial that both completed, with the same sample and seed. A metric that is infinite in some "
    "trial is not tested."
)


def sentences(findings: Findings) -> list[str]:
    """Sentences on the nominal model and on failures, one for every two candidates, then the Pareto fronts."""
    failures = [sentence for name in findings.names if (sentence := failed(findings, name))]
    alone = [
        _alone(completion)
        for completion in findings.completions
        if completion.only_candidate or completion.only_baseline
    ]
    nominal_model = [findings.nominal_model] if findings.nominal_model else []
    between = [_between(findings, *pair) for pair in findings.pairs()]
    return [*nominal_model, *failures, *alone, *between, *map(_front, findings.fronts)]


def failed(findings: Findings, name: str) -> str:
    """How the failed and invalid trials of a candidate ended; empty without any."""
    unfinished = {word: number for word, number in findings.endings[name].items() if word != COMPLETED}
    if not unfinished:
        return ""
    causes = ", ".join(f"{word.replace('_', ' ')} {number}" for word, number in unfinished.items())
    when = findings.failed_at[name]
    after = "" if math.isnan(when) else f", median time {when:.3g} s"
    return f"{name} did not complete {sum(unfinished.values())} of {findings.trials} trials ({causes}{after})."


def _alone(completion: Completion) -> str:
    verb = "is established" if completion.p_holm < LEVEL else "is not established"
    candidate, baseline = completion.candidate, completion.baseline
    return (
        f"{candidate} completed {completion.only_candidate} trials that {baseline} did not, and {baseline} "
        f"{completion.only_baseline} that {candidate} did not; this difference {verb} (McNemar's exact test, "
        f"p = {completion.p_holm:.2g})."
    )


def _front(front: Front) -> str:
    dominated = [name for name in front.points if name not in front.front and name not in front.incomplete]
    metrics = f"{metric_name(front.error)} against {metric_name(front.effort)}"
    sentence = f"Pareto front of {metrics}: {', '.join(front.front) or 'none'}"
    sentence += f"; dominated: {', '.join(dominated)}" if dominated else ""
    missing = f"; not judged because trials failed: {', '.join(front.incomplete)}" if front.incomplete else ""
    return f"{sentence}{missing}."


def metric_name(metric: str) -> str:
    """A metric in a few words, within a sentence that separates by commas."""
    return titled_name(metric).replace(",", "")


def value_with_unit(value: float, unit: str) -> str:
    """A value in three digits with its unit; angles in degrees."""
    number, unit = display_units(value, unit)
    return f"{digits(number)} {unit}".rstrip()


def digits(value: float) -> str:
    """A number in three digits, whole from 1000 on; a power of ten where it is very small or large."""
    if value and math.isfinite(value) and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.2e}"
    return f"{value:.3g}" if not 1000 <= abs(value) < math.inf else f"{value:.0f}"


def relative(difference: PairedDifference, unit: str, number: Callable[[float], str] = digits) -> str:
    """Median difference in percent of the baseline, beyond 1000 % as a multiple of it; in the unit of the metric where
    the baseline has zeros."""
    if math.isnan(difference.relative):
        return f"{'+' if difference.median > 0 else ''}{value_with_unit(difference.median, unit)}"
    if difference.relative > _MANIFOLD:
        return f"{number(1 + difference.relative)} times"
    sign = "+" if difference.relative > 0 else ""
    return f"{sign}{number(100 * difference.relative)} %"


def _between(findings: Findings, candidate: str, baseline: str) -> str:
    differences = [difference for difference in findings.against(candidate, baseline) if difference.pairs]
    sentence = f"{candidate} against {baseline}"
    if not differences:
        return f"{sentence}: there is no trial that both completed."
    pairs = max(difference.pairs for difference in differences)
    sentence += f" ({pairs} {'pair' if pairs == 1 else 'pairs'})"
    if not any(difference.smaller or difference.larger for difference in differences):
        return f"{sentence}: all differences are zero."
    if findings.all_equal:
        sizes = [relative(difference, findings.units[difference.metric]) for difference in differences]
        parts = [
            f"{metric_name(difference.metric)} {size}" for difference, size in zip(differences, sizes, strict=True)
        ]
        return f"{sentence}: {', '.join(parts)}. All trials are equal, so that nothing is established by statistics."
    if pairs < (needed := needed_pairs(findings)):
        return f"{sentence}: too few to establish a difference; at least {needed} pairs are needed."
    established = [difference for difference in differences if difference.established]
    smaller = [
        _counted(findings, difference, difference.smaller) for difference in established if difference.median < 0
    ]
    larger = [_counted(findings, difference, difference.larger) for difference in established if difference.median > 0]
    undecided = [metric_name(difference.metric) for difference in differences if not difference.established]
    parts = [f"smaller {', '.join(smaller)}"] if smaller else []
    parts += [f"larger {', '.join(larger)}"] if larger else []
    parts += [f"no difference is established in {', '.join(undecided)}"] if undecided else []
    return f"{sentence}: {'; '.join(parts)}."


def needed_pairs(findings: Findings) -> int:
    """Pairs from which on the smallest p of the rank test, 2^(1 - n), is below 5 % after correction for all tests."""
    tests = sum(bool(difference.smaller or difference.larger) for difference in findings.differences)
    return max(FEWEST, math.floor(1 + math.log2(max(tests, 1) / LEVEL)) + 1)


def _counted(findings: Findings, difference: PairedDifference, number: int) -> str:
    size = relative(difference, findings.units[difference.metric])
    return f"{metric_name(difference.metric)} ({size}, in {number} of {difference.pairs})"
