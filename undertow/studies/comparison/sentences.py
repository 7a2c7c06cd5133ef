"""The findings of a comparison in sentences: failures, and what is established between every two candidates."""

import math

from undertow.analysis.metrics import for_people
from undertow.studies.comparison.findings import COMPLETED, Findings
from undertow.studies.comparison.paired import FEWEST, LEVEL, Completion, PairedDifference
from undertow.studies.comparison.pareto import Front

HOW = (
    "A difference counts as established where the two-sided Wilcoxon signed-rank test is below 5 % with Holm's "
    "correction for all tests of this comparison, and the 95 % bootstrap interval of the median difference excludes "
    "zero. A pair is a trial that both completed, with the same sample and seed. A metric that is infinite in some "
    "trial is not tested."
)


def sentences(found: Findings) -> list[str]:
    """Sentences on the nominal model and on failures, one for every two candidates, then the Pareto fronts."""
    failures = [sentence for name in found.names if (sentence := failed(found, name))]
    alone = [_alone(one) for one in found.completions if one.only_candidate or one.only_baseline]
    known = [found.nominal_model] if found.nominal_model else []
    return [*known, *failures, *alone, *(_between(found, *pair) for pair in found.pairs()), *map(_front, found.fronts)]


def failed(found: Findings, name: str) -> str:
    """How the failed and invalid trials of a candidate ended; empty without any."""
    others = {word: number for word, number in found.endings[name].items() if word != COMPLETED}
    if not others:
        return ""
    causes = ", ".join(f"{word.replace('_', ' ')} {number}" for word, number in others.items())
    when = found.failed_at[name]
    after = "" if math.isnan(when) else f", median time {when:.3g} s"
    return f"{name} did not complete {sum(others.values())} of {found.trials} trials ({causes}{after})."


def _alone(one: Completion) -> str:
    verb = "is established" if one.p_holm < LEVEL else "is not established"
    return (
        f"{one.candidate} completed {one.only_candidate} trials that {one.baseline} did not, and {one.baseline} "
        f"{one.only_baseline} that {one.candidate} did not; this difference {verb} (McNemar's exact test, "
        f"p = {one.p_holm:.2g})."
    )


def _front(one: Front) -> str:
    others = [name for name in one.points if name not in one.front and name not in one.incomplete]
    said = (
        f"Pareto front of {metric_name(one.error)} against {metric_name(one.effort)}: {', '.join(one.front) or 'none'}"
    )
    said += f"; dominated: {', '.join(others)}" if others else ""
    missing = f"; not judged because trials failed: {', '.join(one.incomplete)}" if one.incomplete else ""
    return f"{said}{missing}."


def metric_name(metric: str) -> str:
    """A metric as words."""
    return metric.replace("_", " ")


def shown(value: float, unit: str) -> str:
    """A value in three digits with its unit; angles in degrees."""
    number, unit = for_people(value, unit)
    return f"{digits(number)} {unit}".rstrip()


def digits(value: float) -> str:
    """A number in three digits, whole from 1000 on; a power of ten where it is very small or large."""
    if value and math.isfinite(value) and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.2e}"
    return f"{value:.3g}" if not 1000 <= abs(value) < math.inf else f"{value:.0f}"


def relative(one: PairedDifference, unit: str) -> str:
    """Median difference in percent of the baseline; in the unit of the metric where the baseline has zeros."""
    if math.isnan(one.relative):
        return f"{'+' if one.median > 0 else ''}{shown(one.median, unit)}"
    sign = "+" if one.relative > 0 else ""
    return f"{sign}{digits(100 * one.relative)} %"


def _between(found: Findings, candidate: str, baseline: str) -> str:
    several = [one for one in found.against(candidate, baseline) if one.pairs]
    said = f"{candidate} against {baseline}"
    if not several:
        return f"{said}: there is no trial that both completed."
    pairs = max(one.pairs for one in several)
    said += f" ({pairs} {'pair' if pairs == 1 else 'pairs'})"
    if not any(one.smaller or one.larger for one in several):
        return f"{said}: all differences are zero."
    if found.all_equal:
        parts = [f"{metric_name(one.metric)} {relative(one, found.units[one.metric])}" for one in several]
        return f"{said}: {', '.join(parts)}. All trials are equal, so that nothing is established by statistics."
    if pairs < (needed := _needed(found)):
        return f"{said}: too few to establish a difference; at least {needed} pairs are needed."
    smaller = [_counted(found, one, one.smaller) for one in several if one.established and one.median < 0]
    larger = [_counted(found, one, one.larger) for one in several if one.established and one.median > 0]
    others = [metric_name(one.metric) for one in several if not one.established]
    parts = [f"smaller {', '.join(smaller)}"] if smaller else []
    parts += [f"larger {', '.join(larger)}"] if larger else []
    parts += [f"no difference is established in {', '.join(others)}"] if others else []
    return f"{said}: {'; '.join(parts)}."


def _needed(found: Findings) -> int:
    """Pairs from which on the smallest p of the rank test, 2^(1 - n), is below 5 % after correction for all tests."""
    tests = sum(bool(one.smaller or one.larger) for one in found.differences)
    return max(FEWEST, math.floor(1 + math.log2(tests / LEVEL)) + 1)


def _counted(found: Findings, one: PairedDifference, number: int) -> str:
    return f"{metric_name(one.metric)} ({relative(one, found.units[one.metric])}, in {number} of {one.pairs})"
