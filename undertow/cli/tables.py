"""Tables of metrics and of the certificate, for the terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Column, Table

from undertow.analysis.metrics import for_people
from undertow.core.metric import Metric


def titled(title: str, *columns: str | Column) -> Table:
    """An empty table with its title at the left."""
    return Table(*columns, title=title, title_justify="left", title_style="bold")


def numbers(title: str) -> Column:
    """A column of numbers, set to the right."""
    return Column(title, justify="right")


def metrics_table(
    steady: dict[str, Any] | None,
    whole: dict[str, Any],
    window: tuple[float, float],
    known: Mapping[str, Metric],
    predicted: dict[str, float] | None = None,
) -> Table:
    """Predicted and measured metrics of the steady window, and the metrics of the whole run."""
    first = [numbers("predicted")] if predicted else []
    late = numbers(f"{window[0]:g} to {window[1]:g} s")
    table = titled("Metrics", "metric", *first, late, numbers("whole run"), "unit")
    for name, metric in known.items():
        if name in whole:
            said = lambda values, name=name, metric=metric: _number(for_people(values[name], metric.unit)[0])
            shown = [said(predicted) if name in predicted else ""] if predicted else []
            late = said(steady) if steady and name in steady else "-"
            table.add_row(name, *shown, late, said(whole), for_people(0.0, metric.unit)[1])
    return table


def certificate_table(certificate: dict[str, Any], window: tuple[float, float]) -> Table:
    """The share of the time for which each hypothesis of the stability proof held, and its first failure."""
    columns = map(numbers, (f"{window[0]:g} to {window[1]:g} s", "whole run", "first fails at"))
    table = titled("Certificate: hypotheses of the stability proof", "hypothesis", *columns)
    for one in certificate["hypotheses"]:
        if one["whole"] is None:
            table.add_row(one["sentence"], "-", "-", one["unknown"])
            continue
        first = "never" if one["first_failure"] is None else f"{one['first_failure']:.4g} s"
        table.add_row(one["sentence"], _share(one["steady"]), _share(one["whole"]), first)
    table.caption, table.caption_justify = "\n".join(_consequences(certificate)), "left"
    return table


def _consequences(certificate: dict[str, Any]) -> list[str]:
    """The quantities of the proof, as sentences."""
    rising = certificate["rising"]
    sentences = [
        f"{certificate['function']}: {_number(certificate['start'])} at the start, {_number(certificate['end'])} at "
        f"the end; rises at {_share(rising['whole'])} of the steps, {_share(rising['steady'])} of the steady ones."
    ]
    if certificate.get("decay") is not None:
        sentences.append(
            f"Mean of 1/2 E^T Q E over the steady window: {_number(certificate['decay'])}; with tanh for sign (Remark "
            f"5) the proof allows a residual of {_number(certificate['residual'])}."
        )
    if "estimation_within" in certificate:
        kept, allowed = certificate["estimation_within"], certificate["estimation_bound"]
        sentences.append(
            f"|d_hat - d| is within the bound that follows from the largest recorded |d_dot| (up to "
            f"{_number(None if None in allowed else max(allowed))}) for {_share(kept['steady'])} of the steady window."
        )
    return sentences


def wide_console() -> Console:
    """Console on stdout; in a pipe its lines are wide enough for every table."""
    console = Console(soft_wrap=False)
    return console if console.is_terminal else Console(width=160)


def _share(value: float | None) -> str:
    """A share in percent; 100 and 0 only where they are exact."""
    if value is None:
        return "-"
    if 0 < value < 1:
        return f"{min(max(100 * value, 0.1), 99.9):.1f} %"
    return f"{100 * value:.0f} %"


def _number(value: float | None) -> str:
    """A number in four digits; null in JSON, which stands for an infinite value, is `-`."""
    if value is None:
        return "-"
    return "never" if value == float("inf") else f"{value:.4g}"
