"""Checks of a bench record before a thruster is fitted: what it cannot tell, and what makes it useless.

Units are judged by what any thruster does: thrust per electrical power depends little on its size.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import isotonic_regression

from undertow.core.errors import BadInput
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.finding import LogFinding

FEWEST_FORWARD = 5  # different voltages that give thrust
FEWEST_REVERSE = 3
_THRUST = 0.02  # share of the largest thrust, from which on there is some
_SAME = 5e-3  # share of the largest voltage, within which voltages are the same
_FALLING = (0.05, 0.2)  # shares of the largest thrust by which it falls while the command rises: reported, an error
_MOST_SUPPLIES = 20  # above which a supply is one that sags, and not several
_DIFFERENT = 0.03  # share of the largest thrust, by which it differs at equal volts
_OFFSET = 0.03  # share of the largest thrust at command 0
_STRONG = 0.6  # of the largest voltage, from which on commands are large
_THRUST_PER_POWER = (0.02, 1.5)  # N/W at large commands
_DOUBTFUL = (0.04, 0.6)
_SPEED_PER_VOLT = (3.0, 300.0)  # rad/s per V

_AS_IF = {9.80665: "kgf", 4.4482: "lbf", 9.80665e-3: "gf"}


def check_bench(tables: Sequence[BenchTable]) -> tuple[LogFinding, ...]:
    """What is worth knowing about the records of a thruster.

    Args:
        tables: records.

    Raises:
        BadInput: nothing can be identified from them, with the reason.
    """
    volts, thrust = (np.concatenate([getattr(table, name) for table in tables]) for name in ("volts", "thrust"))
    names = ", ".join(table.name for table in tables)
    largest = float(np.abs(thrust).max(initial=0.0))
    if not largest > 0 or np.ptp(thrust) < 1e-3 * largest:
        raise BadInput("bench", "have a thrust that changes", f"{names}, where it is {largest:.3g} N throughout")
    _check_direction(volts, thrust, names)
    levels = {sign: _levels(volts[(np.sign(volts) == sign) & (np.abs(thrust) > _THRUST * largest)]) for sign in (1, -1)}
    if levels[1] < FEWEST_FORWARD:
        must = f"have thrust at {FEWEST_FORWARD} forward commands or more: gain, curvature and dead zone are unknown"
        raise BadInput("bench", must, f"{names} with {levels[1]}")
    findings = [LogFinding("log", "", "note", f"{table.name}: {note}") for table in tables for note in table.notes]
    if levels[-1] < FEWEST_REVERSE:
        count = f"{levels[-1]} reverse commands give thrust" if levels[-1] else "there is no thrust in reverse"
        remedy = "What is known of reverse is an assumption: record at least 3 commands there"
        findings.append(LogFinding("axis", "reverse", "refused", count, remedy))
    settled = [table for table in tables if table.time is None]
    if settled:
        findings += _monotone(settled, largest)
        findings += [finding for table in settled for finding in _supplies(table, largest)]
    findings += _offset(volts, thrust, largest)
    for table in tables:
        findings += _dead_columns(table) + _units(table)
    if not any(table.time is not None for table in tables):
        remedy = "Record steps of the command, 20 rows a second or more, with a column of time"
        findings.append(LogFinding("axis", "lag", "refused", "no record over time shows how thrust follows", remedy))
    return tuple(findings)


def has_reverse(findings: Sequence[LogFinding]) -> bool:
    """Whether thrust in reverse can be identified."""
    return not any(finding.name == "reverse" and finding.severity == "refused" for finding in findings)


def _levels(volts: np.ndarray) -> int:
    """How many different voltages there are."""
    if not len(volts):
        return 0
    return len(np.unique(np.round(volts / (_SAME * np.abs(volts).max()))))


def _check_direction(volts: np.ndarray, thrust: np.ndarray, names: str) -> None:
    """Refuse thrust that goes against the command."""
    forward = volts > 0
    if not forward.any():
        raise BadInput("bench", "have forward commands", names, hint="Change the signs of command and thrust")
    if float((thrust * volts)[forward].sum()) < 0:
        got = f"{names}, where positive commands give negative thrust"
        hint = "Change the sign of the column of thrust (or of the command, if the propeller turns the other way)"
        raise BadInput("bench", "have a thrust in the direction of the command", got, hint=hint)
    if (volts < 0).any() and float((thrust * volts)[volts < 0].sum()) < 0:
        got = f"{names}, where negative commands give positive thrust"
        raise BadInput("bench", "have a thrust in the direction of the command", got, hint="Is its sign lost?")


def _monotone(tables: Sequence[BenchTable], largest: float) -> list[LogFinding]:
    """By how much thrust falls while the command rises; at one supply after the other."""
    worst, where = 0.0, 0.0
    for table in tables:
        for supply in np.unique(np.round(table.supply, 1)):
            rows = np.flatnonzero(np.round(table.supply, 1) == supply)
            order = rows[np.argsort(table.volts[rows], kind="stable")]
            error = np.abs(isotonic_regression(table.thrust[order]).x - table.thrust[order])
            if error.max() > worst:
                worst, where = float(error.max()), float(table.volts[order[np.argmax(error)]])
    sentence = f"thrust falls while the command rises: by {2 * worst:.2g} N around {where:.3g} V"
    if worst > _FALLING[1] * largest:
        raise BadInput("bench", "have a thrust that rises with the command", sentence, hint="Are columns interchanged?")
    if worst < _FALLING[0] * largest:
        return []
    return [
        LogFinding("log", "", "note", sentence, "Look at these rows: did air reach the propeller, or the supply sag")
    ]


def _supplies(table: BenchTable, largest: float) -> list[LogFinding]:
    """By how much thrust differs at equal volts between supplies."""
    supplies = np.unique(np.round(table.supply, 1))
    curves = []
    for supply in supplies:
        rows = np.flatnonzero(np.round(table.supply, 1) == supply)
        rows = rows[np.argsort(table.volts[rows], kind="stable")]
        curves.append((table.volts[rows], table.thrust[rows]))
    volts, thrust = curves[0]
    difference = max((float(np.abs(np.interp(volts, *curve) - thrust).max()) for curve in curves[1:]), default=0.0)
    if len(supplies) > _MOST_SUPPLIES or difference < _DIFFERENT * largest:
        return []
    names = ", ".join(f"{supply:g}" for supply in supplies)
    sentence = f"{table.name}: at equal volts thrust differs by up to {difference:.2g} N between supplies of {names} V"
    return [LogFinding("log", "", "note", sentence, "Choose the rows of yours with --supply")]


def _offset(volts: np.ndarray, thrust: np.ndarray, largest: float) -> list[LogFinding]:
    """A load cell that shows thrust without a command."""
    still = np.abs(volts) < 1e-9
    offset = float(np.median(thrust[still])) if still.any() else 0.0
    if abs(offset) < _OFFSET * largest:
        return []
    sentence = f"at command 0 the thrust is {offset:.3g} N"
    return [LogFinding("log", "", "note", sentence, "Subtract what the load cell shows at rest")]


def _dead_columns(table: BenchTable) -> list[LogFinding]:
    findings = []
    for name in ("current", "speed"):
        values = getattr(table, name)
        values = np.abs(values[np.isfinite(values) & (np.abs(table.thrust) > 0)])
        if len(values) and np.ptp(values) <= 1e-3 * values.max():
            sentence = f"{table.name}: {name} is {values.max():.3g} throughout"
            findings.append(LogFinding("sensor", name, "left_out", sentence, "It is not used"))
    return findings


def _units(table: BenchTable) -> list[LogFinding]:
    """Thrust per power and speed per volt that no thruster has, or few."""
    findings = []
    moving = np.abs(table.volts) > _STRONG * np.abs(table.volts).max()
    power = np.abs(table.current * table.supply)
    powered = moving & (np.nan_to_num(power) > 0)
    if powered.any():
        ratio = float(np.median(np.abs(table.thrust[powered]) / power[powered]))
        sentence = f"{ratio:.2g} N/W at large commands"
        if not _THRUST_PER_POWER[0] <= ratio <= _THRUST_PER_POWER[1]:
            must = f"have a plausible thrust: {_DOUBTFUL[0]:g} to {_DOUBTFUL[1]:g} N/W"
            raise BadInput("bench", must, f"{table.name} with {sentence}", hint=_unit_hint(ratio))
        if not _DOUBTFUL[0] <= ratio <= _DOUBTFUL[1]:
            remedy = "Few thrusters do that: check the units of thrust and current"
            findings.append(LogFinding("sensor", "thrust", "note", f"{table.name}: {sentence}", remedy))
    if table.has("speed") and np.isfinite(table.speed[moving]).any():
        ratio = float(np.nanmedian(table.speed[moving] / table.volts[moving]))
        if not _SPEED_PER_VOLT[0] <= ratio <= _SPEED_PER_VOLT[1]:
            sentence = f"{table.name}: the propeller turns at {ratio:.3g} rad/s per volt"
            findings.append(LogFinding("sensor", "speed", "left_out", sentence, "Check the unit: rpm or rad/s"))
    return findings


def _unit_hint(ratio: float) -> str:
    fitting = [unit for factor, unit in _AS_IF.items() if _DOUBTFUL[0] <= ratio * factor <= _DOUBTFUL[1]]
    return f"It would be plausible in {' or '.join(fitting)}: name the unit of thrust in the header" if fitting else ""
