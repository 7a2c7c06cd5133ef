"""The tables of a comparison as Markdown, LaTeX (booktabs) and CSV."""

import csv
import io
import math
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from undertow.analysis.metrics import titled_name
from undertow.core.number_text import display_units, infinite
from undertow.studies.comparison.findings import Findings, Median
from undertow.studies.comparison.paired import PairedDifference
from undertow.studies.comparison.sentences import digits, relative
from undertow.studies.comparison.step_time import StepTime

NOTE = (
    "Median over completed trials [95 % interval of the median]; metrics of the steady window. "
    "* marks an established difference from the first column (Wilcoxon signed-rank test with Holm's correction)."
)
STEP = "computing time per step (\u00b5s)"
_NOTHING = "-"


class TextTable(NamedTuple):
    """A table of text: column titles and rows, of which the first entry names the row."""

    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


def medians(
    findings: Findings, times: Mapping[str, StepTime] | None = None, number: Callable[[float], str] = digits
) -> TextTable:
    """Metrics by candidate, below the number of completed trials.

    Args:
        findings: of the comparison.
        times: computing time of a step of each law, for a last row; None where it was not measured.
        number: how a number is written.
    """
    first = findings.names[0]
    rows = [("completed trials", *(f"{findings.completed(name)} of {findings.trials}" for name in findings.names))]
    if any(judged for _, judged in findings.successes.values()):
        successes = (findings.successes[name] for name in findings.names)
        rows.append(("within the criterion of success", *(f"{within} of {judged}" for within, judged in successes)))
    for metric, by_name in findings.medians.items():
        of_metric = [difference for difference in findings.differences if _is(difference, metric)]
        marked = {difference.candidate for difference in of_metric if difference.baseline == first}
        unit = findings.units[metric]
        cells = (f"{median(by_name[name], unit, number)}{'*' * (name in marked)}" for name in findings.names)
        rows.append((titled(findings, metric), *cells))
    if times:
        rows.append((STEP, *(_time(times.get(name)) for name in findings.names)))
    return TextTable(("metric", *findings.names), rows)


def _time(step_time: StepTime | None) -> str:
    """A time in microseconds, marked where the step could not be compiled by the batch compiler."""
    if step_time is None:
        return _NOTHING
    return f"{digits(1e6 * step_time.median)}{'' if step_time.backend == 'simd' else ' (XLA)'}"


def paired(findings: Findings, number: Callable[[float], str] = digits) -> TextTable:
    """Differences of every two candidates in every metric."""
    rows = []
    for difference in findings.differences:
        unit = findings.units[difference.metric]
        of = lambda count, difference=difference: f"{count} of {difference.pairs}"
        rows.append(
            (
                f"{difference.candidate} - {difference.baseline}",
                titled(findings, difference.metric),
                median(Median(difference.median, difference.low, difference.high, difference.pairs), unit, number),
                _NOTHING if math.isnan(difference.relative) else relative(difference, unit, number),
                of(difference.smaller),
                _NOTHING if math.isnan(difference.p_holm) else number(difference.p_holm),
                "yes" if difference.established else "no",
            )
        )
    head = ("pair", "metric", "median difference", "relative", "smaller in", "p (Holm)", "established")
    return TextTable(head, rows)


def median(estimate: Median, unit: str, number: Callable[[float], str] = digits) -> str:
    """A median with its interval, in the unit of tables for people."""
    if math.isnan(estimate.value):
        return _NOTHING
    value, low, high = (value_in(quantity, unit, number) for quantity in estimate[:3])
    return value if math.isnan(estimate.low) else f"{value} [{low}, {high}]"


def value_in(value: float, unit: str, number: Callable[[float], str] = digits) -> str:
    """A value in the unit of tables for people, without its name."""
    return infinite(unit) if math.isinf(value) else number(display_units(value, unit)[0])


def titled(findings: Findings, metric: str) -> str:
    """A metric with its unit."""
    unit = display_units(0.0, findings.units[metric])[1]
    return f"{titled_name(metric)} ({unit})" if unit else titled_name(metric)


def _is(difference: PairedDifference, metric: str) -> bool:
    return difference.metric == metric and difference.established


def table(findings: Findings, style: str) -> str:
    """Both tables in one of `STYLES`."""
    return STYLES[style](findings)


def _markdown(findings: Findings) -> str:
    parts = [_markdown_rows(medians(findings)), f"{NOTE}\n", _markdown_rows(paired(findings))]
    return "\n".join(parts)


def _markdown_rows(rows: TextTable) -> str:
    line = lambda cells: f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"
    ruler = f"|{'---|' * len(rows.head)}\n"
    return "".join([line(rows.head), ruler, *map(line, rows.rows)])


def _latex(findings: Findings) -> str:
    pairs = "Paired differences: median over the trials that both completed [95 % interval]."
    lines = ["% Needs \\usepackage{booktabs,tabularx}. Wide tables fit on a page as table* or within landscape.", ""]
    lines += [*_floating(medians(findings, number=even_digits), NOTE, "medians"), ""]
    return "\n".join([*lines, *_floating(paired(findings, number=even_digits), pairs, "differences")]) + "\n"


def even_digits(value: float) -> str:
    """A number as `digits` writes it, with zeros at its end: three digits in every cell of a column."""
    if not value or not 1e-4 <= abs(value) < 1000:
        return digits(value)
    return f"{value:#.3g}".rstrip(".")


def _floating(rows: TextTable, caption: str, label: str) -> list[str]:
    """A table as wide as the text, whose first column takes what the others leave."""
    line = lambda cells: f"{' & '.join(map(_escaped, cells))} \\\\"
    columns = "X" + "r" * (len(rows.head) - 1)
    body = ["\\toprule", line(rows.head), "\\midrule", *map(line, rows.rows), "\\bottomrule"]
    begin = ["\\begin{table}", "\\centering", f"\\caption{{{_escaped(caption)}}}", f"\\label{{tab:{label}}}"]
    begin.append(f"\\begin{{tabularx}}{{\\linewidth}}{{{columns}}}")
    return [*begin, *body, "\\end{tabularx}", "\\end{table}"]


_LATEX = re.compile(
    r"(?<![\w.])(?P<sign>-?)(?P<mantissa>\d+(?:\.\d+)?)e(?P<power>[+-]\d+)|(?P<minus>(?<![\w.])-(?=[\d. ]))"
    r"|\^(?P<exponent>-?\d+)|(?P<infinite>\binf\b)|(?P<special>[\\~^*&%$#_{}])"
)
_SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "*": r"$^{*}$"}


def _escaped(cell: str) -> str:
    """A cell as LaTeX: minus signs, powers of ten, exponents of units and special characters."""

    def written(match: re.Match) -> str:
        if match["mantissa"]:
            return rf"${match['sign']}{match['mantissa']} \times 10^{{{int(match['power'])}}}$"
        if match["minus"]:
            return "$-$"
        if match["infinite"]:
            return r"$\infty$"
        if match["exponent"]:
            return f"$^{{{match['exponent']}}}$"
        return _SPECIAL.get(match["special"], f"\\{match['special']}")

    return _LATEX.sub(written, cell)


def _csv(findings: Findings) -> str:
    stream = io.StringIO()
    fields = [name for name in PairedDifference._fields if name != "metric"]
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["metric", "unit", "candidate_median", "baseline_median", *fields, "established"])
    for difference in findings.differences:
        metric = difference.metric
        by_name = findings.medians[metric]
        values = [by_name[difference.candidate].value, by_name[difference.baseline].value]
        writer.writerow(
            [
                metric,
                findings.units[metric],
                *values,
                *(getattr(difference, name) for name in fields),
                difference.established,
            ]
        )
    return stream.getvalue()


STYLES: dict[str, Callable[[Findings], str]] = {"markdown": _markdown, "latex": _latex, "csv": _csv}
