"""Writes the section `thruster` of a scenario that an identification gives, with intervals as comments."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow.core.atomic_io import write_whole
from undertow.core.number_text import DIGITS
from undertow.scenario.factory import make
from undertow.scenario.yaml_text import load

_WRITTEN = 6  # digits

# Options that no bench record of settled rows tells, and what is written beside them.
_ASSUMED = {
    "time_constant": "s; assumed, as no record over time shows it",
    "rotor_inertia": "kg m^2; assumed, so that the speed lags by 0.1 s, as no record over time shows it",
    "reverse_share": "assumed, as there is no thrust in reverse",
}
_CHOSEN = {
    "linear_gain": "N/V; slope that preset paper assumes",
    "supply": "V; largest of the bench",
    "dead_zone": "V",
    "dead_zone_kind": "what is beyond the zone: pass, all of it, or subtract, its part beyond",
}


def write_thruster(path: Path, data: Mapping[str, Any]) -> None:
    """Write the section, and the other form of the thruster as comments; the file is whole or not there.

    Args:
        path: of the file.
        data: contents of identification.json.

    Raises:
        BadInput: a scenario would not accept the section.
        OSError: the file cannot be written.
    """
    first, *others = data["forms"]
    names = ", ".join(bench["name"] for bench in data["bench"])
    lines = [
        f"# Thruster identified by undertow {data['version']} on {data['date']} from {names}.",
        f"# Thrust of rows that were left out: error of {_short(first['rms_left_out']['thrust'])} N rms.",
        "# Put it into the section `plant` of a scenario. Intervals are of 95 %.",
        *_section(first),
    ]
    for other in others:
        error = _short(other["rms_left_out"]["thrust"])
        lines += ["", f"# Or, with an error of {error} N rms:", *(f"# {line}" for line in _section(other))]
    text = "\n".join(lines) + "\n"
    accepted, _ = load(text, path.name, "thruster")
    make("thrusters", accepted["thruster"], path.parent)
    write_whole(path, text)


def _section(form: Mapping[str, Any]) -> list[str]:
    lines = ["thruster:"]
    for name, value in form["section"].items():
        number = float(f"{value:.{_WRITTEN}g}") if isinstance(value, float) else value
        comment = _comment(name, form["parameters"].get(name))
        lines.append(f"  {name}: {number}" + (f"  # {comment}" if comment else ""))
    return lines


def _comment(name: str, parameter: Mapping[str, Any] | None) -> str:
    if parameter is None:
        return _ASSUMED.get(name, _CHOSEN.get(name, ""))
    interval = f"{_short(parameter['low'])} to {_short(parameter['high'])}"
    return "; ".join(filter(None, (parameter["unit"], interval)))


def _short(value: float) -> str:
    return f"{value:.{DIGITS}g}"
