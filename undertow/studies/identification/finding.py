"""What the checks before an identification say of a log."""

from collections.abc import Mapping
from typing import NamedTuple

from undertow.studies.identification.clock_offset import ClockOffset

# What a finding means: for information; a sensor or input that must not be used; an axis, or with the concern `log` the
# whole log, that cannot be identified.
SEVERITIES = ("note", "left_out", "refused")

# Sensors in words.
WORDS = {
    "position": "position",
    "attitude": "attitude",
    "velocity": "velocity",
    "rates": "angular velocity",
    "depth": "depth",
}


class LogFinding(NamedTuple):
    """One thing that is worth knowing about a log.

    Attributes:
        concern: `sensor`, `axis`, `input` or `log`.
        name: of the sensor (as in `dive.SENSORS`; `attitude.yaw` for one of its numbers), axis or input; "" of a log.
        severity: one of SEVERITIES.
        sentence: what was found, with its numbers, without full stop.
        remedy: what to do, without full stop; "" where there is nothing to be done.
    """

    concern: str
    name: str
    severity: str
    sentence: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.sentence}. {self.remedy}." if self.remedy else f"{self.sentence}."


class DiveCheck(NamedTuple):
    """Result of the checks of a log.

    Attributes:
        findings: the gravest first.
        offsets: delay of `rates` behind the attitude, of `velocity` behind the position, and of `inputs` behind the
            motion that they cause; those that the log can tell.
    """

    findings: tuple[LogFinding, ...]
    offsets: Mapping[str, ClockOffset]

    def left_out(self) -> list[str]:
        """Sensors, or numbers of a sensor, that must not be used."""
        return _names(self.findings, "sensor", "left_out")

    def refused_axes(self) -> list[str]:
        """Axes that cannot be identified."""
        return _names(self.findings, "axis", "refused")

    def errors(self) -> list[LogFinding]:
        """Why the log cannot be used at all; () where it can."""
        return [f for f in self.findings if f.severity == "refused" and f.concern in ("log", "input")]


def _names(findings: tuple[LogFinding, ...], concern: str, severity: str) -> list[str]:
    return list(dict.fromkeys(f.name for f in findings if f.concern == concern and f.severity == severity))
