"""The answer of `undertow falsify`: what breaks a requirement, and how little it takes."""

from collections.abc import Iterator
from pathlib import Path

from undertow.report.answers.plain_answer import PlainAnswer
from undertow.studies.falsification.falsify import Falsified

_MOST = 4  # keys that are named


def answer_of_falsification(falsification: Falsified, folder: Path) -> PlainAnswer:
    """The answer of a falsification.

    Args:
        falsification: its result.
        folder: of its files.
    """
    method = "by differentiation" if falsification.differentiated else "by differences"
    ending = "the search has converged" if falsification.finished else "the budget is used up"
    search = f"{falsification.objective.runs} runs, gradients {method}; {ending}."
    remarks = [sentence for sentence in (falsification.nominal_model(),) if sentence]
    if falsification.violation is None:
        least = min(falsification.objective.robustnesses)
        verdict = "No run within the bounds violates a requirement. This proves nothing: it is a search."
        return PlainAnswer(None, verdict, (f"Least robustness {least:.3g}, where 0 is a violation.", search, *remarks))
    lines = (*_departure(falsification), search, *remarks, _repetition(falsification, folder))
    return PlainAnswer(False, f"A departure within the bounds {violated(falsification)}.", lines)


def violated(falsification: Falsified) -> str:
    """Which requirements the counter-example violates."""
    broken = [f"{name} (robustness {value:.3g})" for name, value in falsification.broken.items() if not value > 0]
    return f"violates {', '.join(broken)}"


def _departure(falsification: Falsified) -> Iterator[str]:
    """The keys that depart most, from what to what."""
    assert falsification.violation is not None
    departures = zip(falsification.box.axes, falsification.violation.departure.tolist(), strict=True)
    largest = sorted(departures, key=lambda pair: -abs(pair[1]))[:_MOST]
    values = falsification.values()
    changes = [f"{axis.key} {axis.nominal:.4g} -> {values[axis.key]:.4g}" for axis, away in largest if away]
    yield f"It takes {100 * falsification.violation.size:.3g} % of the bounds (norm): {', '.join(changes)}."


def _repetition(falsification: Falsified, folder: Path) -> str:
    repeats = "repeats" if falsification.repeated() else "does not repeat"
    return f"A single run {repeats} this bit for bit: undertow simulate {folder / 'counterexample.yaml'}"
