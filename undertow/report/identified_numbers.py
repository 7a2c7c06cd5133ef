"""What the pages of identified vehicles and thrusters share: intervals, verdicts, and findings of the checks."""

from collections.abc import Mapping
from typing import Any

from undertow.report.formats import number, prose
from undertow.report.page import Html, bullets, join

VERDICTS = {"determined": "determined", "partly": "partly determined", "unknown": "not determined"}


def interval_of(entry: Mapping[str, Any]) -> Html:
    """An interval as a cell of a table."""
    return join(number(entry["low"]), " to ", number(entry["high"]))


def findings_of(data: Mapping[str, Any]) -> list[Html]:
    """Findings of the checks as a list; nothing without any."""
    return [bullets([prose(sentence) for sentence in data["findings"]])] if data["findings"] else []
