"""`undertow check`: report errors and warnings for a vehicle, another part, a scenario, or a campaign."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.text import Text

from undertow.cli.exit_codes import BAD_INPUT, DONE
from undertow.cli.options.check import CheckCommand
from undertow.cli.tables import print_lines, titled, wide_console
from undertow.core.errors import BadInput
from undertow.report.answers.check_answer import answer_of_check
from undertow.scenario.checks import check as checks
from undertow.scenario.checks.check import Report
from undertow.scenario.checks.finding import Finding
from undertow.scenario.reading import read
from undertow.scenario.validation import kind_of
from undertow.scenario.vehicle_file import is_vehicle_file
from undertow.scenario.yaml_text import load
from undertow.studies.campaign.prepare import prepare


def check(command: CheckCommand) -> int:
    """Print the findings of a check and the derived quantities; return the exit code."""
    thing, options = command.thing, command.option or []
    if is_vehicle_file(thing) and Path(thing).is_file() and kind_of(read(Path(thing)).data) == "campaign":
        return _check_campaign(Path(thing), options, command.allow_code)
    values = dict(map(_option, options))
    report = checks.check(thing, values, command.allow_code)
    console = wide_console()
    for sentence in report.sentences:
        print(sentence)
    for title, rows in report.tables:
        table = titled(title, "", "value", "unit")
        for row in rows:
            table.add_row(*map(Text, row))
        console.print(table)
    print_lines(console, answer_of_check(thing, report, values).text)
    return BAD_INPUT if report.errors else DONE


def _check_campaign(path: Path, options: Sequence[str], allow_code: bool) -> int:
    """Check a campaign as `undertow campaign` does before its first trial; print the advice."""
    if options:
        raise BadInput("--option", "be left out for a campaign", options[0])
    prepared = prepare(path, allow_code)
    for sentence in prepared.advice:
        print(f"Advice: {sentence}")
    number = prepared.trials.number
    combinations = len(prepared.trials.combinations)
    of = f" of {combinations} combinations" if combinations > 1 else ""
    found = tuple((Finding("advice", "campaign", "", sentence), "") for sentence in prepared.advice)
    answer = answer_of_check(str(path), Report(found, kind="campaign"))
    print_lines(wide_console(), [answer.verdict, f"It has {number} trials{of}.", *answer.lines])
    return DONE


def _option(text: str) -> tuple[str, Any]:
    """Split KEY=VALUE and read the value as YAML."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise BadInput("--option", "be KEY=VALUE", text)
    return key, load(value, "", "--option")[0]
