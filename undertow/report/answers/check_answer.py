"""The answer of `undertow check`: whether a thing can be used and is plausible, and what to do next."""

import json
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from undertow.core.number_text import counted
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.answers.vehicle_answer import vehicle_lines
from undertow.scenario.checks.check import Report

_RUN = ("scenario", "campaign")
# Where a part of a kind stands in a scenario.
_IN_SCENARIO = {
    "vehicles": "plant: {{vehicle: {0}}}",
    "thrusters": "plant: {{thruster: {0}}}",
    "plants": "plant: {0}",
    "controllers": "controller: {0}",
    "disturbances": "disturbance: {0}",
    "references": "reference: {0}",
    "navigation": "navigation: {0}",
    "sensors": "navigation: {{sensors: [{0}]}}",
}


def answer_of_check(thing: str, report: Report, options: Mapping[str, Any] | None = None) -> PlainAnswer:
    """The answer of a check.

    Args:
        thing: as the user named it.
        report: of its check.
        options: that were given with it.
    """
    advice = len(report.found) - report.errors
    counts = f"{counted(report.errors, 'error')}, {counted(advice, 'piece')} of advice"
    lines = (*_first(report), *_behaviour(report), *_next(thing, report, options or {}))
    good = False if report.errors else None if advice else True
    return PlainAnswer(good, f"{thing}: {counts}. {_verdict(report)}", lines)


def _verdict(report: Report) -> str:
    use = "be run" if report.kind in _RUN else "be used"
    if report.errors:
        return f"It cannot {use} like this."
    if report.found:
        return f"It can {use}, but look at the advice first."
    return f"It can {use}, and nothing in it is implausible."


def _first(report: Report) -> Iterator[str]:
    """The first finding again, which stands above the tables."""
    if report.found and (report.tables or len(report.found) > 1):
        finding = report.sentences[0].partition(": ")[2]
        yield f"Begin with: {finding}{'' if finding.endswith('?') else '.'}"


def _behaviour(report: Report) -> Iterator[str]:
    if report.vehicle is not None and not report.errors:
        yield from vehicle_lines(report.vehicle)


def _next(thing: str, report: Report, options: Mapping[str, Any]) -> Iterator[str]:
    name = shlex.quote(thing)
    if report.errors:
        yield "Next: mend this, and check again."
    elif report.kind == "scenario":
        yield f"Next: undertow simulate {name}"
    elif report.kind == "campaign":
        yield f"Next: undertow campaign {name}"
    elif report.kind == "vehicle file":
        yield f"Next: `undertow init --vehicle {name}` writes a scenario for it."
    elif report.kind in _IN_SCENARIO:
        part = thing
        if options:
            values = (f"{key}: {json.dumps(value)}" for key, value in options.items())
            part = f"{{{', '.join((f'kind: {thing}', *values))}}}"
        entry = _IN_SCENARIO[report.kind].format(part)
        yield f"Next: write `{entry}` in a scenario, and run `undertow simulate` with it."
