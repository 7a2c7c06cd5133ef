"""The answer of `undertow tune`: which gains to take, and how much better they are where they were not tuned."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.scenario.sampled_plants import OF_FILE
from undertow.studies.tuning.cost import times_other
from undertow.studies.tuning.tune import Tuned


def answer_of_tuning(tuning: Tuned, folder: Path) -> PlainAnswer:
    """The answer of a tuning.

    Args:
        tuning: its result.
        folder: of its files.
    """
    initial, *_, tuned = tuning.evaluated
    better = tuning.kept is not initial
    cost = f"on held-out runs their cost is {times_other(tuned.held_out_cost, initial.held_out_cost)}"
    if better:
        verdict = f"The tuned gains are taken: {cost} with the given gains."
    elif tuning.broken:
        verdict = (
            f"The given gains are kept. Others were found, and {cost} with the given ones, but they break a limit."
        )
    else:
        verdict = f"The given gains are kept. Others were found, but {cost} with the given ones."
    lines = (
        *_errors(tuning),
        *_gains(tuning),
        *_certificate(tuning),
        *_vehicles(tuning),
        _search(tuning),
        *_next(tuning, folder),
    )
    return PlainAnswer(True if better else None, verdict, lines)


def _errors(tuning: Tuned) -> Iterator[str]:
    """Errors on held-out runs with the given and with the tuned gains, beside the limits of the scenario."""
    initial, *_, tuned = tuning.evaluated
    built = tuning.problem.built
    metrics, limits = built.known_metrics(), built.criterion()
    for key in ("position_rms", "attitude_rms"):
        if key in metrics and key in limits:
            unit = metrics[key].unit
            before, after = (quantity(gains.held_out_error(key), unit) for gains in (initial, tuned))
            name = metrics[key].named(key)
            limit = quantity(limits[key], unit)
            yield f"{name[:1].upper()}{name[1:]} on held-out runs: {before} before, {after} after (limit {limit})."


def _gains(tuning: Tuned) -> Iterator[str]:
    options = tuning.evaluated[-1].options or {}
    if options:
        found = ", ".join(f"{name} {short_gain(value)}" for name, value in options.items())
        yield f"{'Gains' if tuning.kept is tuning.evaluated[-1] else 'Best gains found'}: {found}."


def _certificate(tuning: Tuned) -> Iterator[str]:
    initial, kept = tuning.evaluated[0], tuning.kept
    if kept.certificate.holds:
        yield f"The linearised loop is stable with them: spectral radius {kept.certificate.worst:.5f}, below 1."
    if not initial.certificate.holds:
        yield "The given gains have no certificate of stability."


def _vehicles(tuning: Tuned) -> Iterator[str]:
    variants = set(tuning.problem.train.variants)
    if len(variants) < 2:
        return
    if OF_FILE in variants:
        vehicles = f"the vehicle of the file and {len(variants) - 1} within its deviations"
    else:
        vehicles = f"{len(variants)} published vehicles"
    yield f"They are tuned for {vehicles}, and judged on others. The controller knows that of the scenario."


def _search(tuning: Tuned) -> str:
    ending = "the search has converged" if tuning.finished else "the time budget is used up"
    if tuning.searched == 0:
        ending += ", and only the initial design (the given gains and points spread over their ranges) was evaluated"
    return (
        f"{tuning.evaluations} evaluations, {tuning.rejected} rejected without a certificate, {tuning.elapsed:.0f} s; "
        f"{ending}."
    )


def _next(tuning: Tuned, folder: Path) -> Iterator[str]:
    if not tuning.finished:
        yield "Next: a larger `--budget` searches on."
    yield f"Next: undertow simulate {folder / 'tuned.yaml'}"


def short_gain(value: Any) -> str:
    """A gain as text; equal gains of several axes are shown once."""
    if not isinstance(value, list):
        return f"{value:g}"
    rows = [short_gain(entry) if isinstance(entry, list) else f"{entry:g}" for entry in value]
    return rows[0] if len(set(rows)) == 1 else f"({', '.join(rows)})"
