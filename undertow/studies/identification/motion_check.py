"""Whether the sensors of a log measure one motion: units, axes, signs and clocks.

Angular velocities are compared with the turns between attitudes, velocities with the steps between positions. A matrix
is fitted that takes the ones to the others: it should be the unit matrix.
"""

import numpy as np
import scipy.optimize

from undertow.logs.log_signals import Series
from undertow.studies.identification.agreement import Agreement, Stream, agreement_of_steps, agreement_of_turns
from undertow.studies.identification.clock_offset import ClockOffset
from undertow.studies.identification.finding import WORDS, LogFinding

_MOVES = {"rates": 0.04, "velocity": 0.05}  # rad, m; typical change in a window, below which nothing can be concluded
_BELONGS, _SURELY_BELONGS = 0.15, 0.5  # share explained
_CONTRIBUTES = 0.4  # share of a number that one of the other stream gives
_SLOPES = (0.8, 1.25)
_DEGREES = (40.0, 80.0)
_LARGEST_OFFSET = 0.2  # s, with which a stream is still used
_WORTH_SAYING = 0.05  # s


def rates_findings(attitude: Series, rates: Stream) -> tuple[list[LogFinding], ClockOffset | None]:
    """Whether the angular velocity (rad/s) goes with the angles (rad)."""
    as_radians = agreement_of_turns(attitude, rates, 1.0)
    as_degrees = agreement_of_turns(attitude, rates, np.pi / 180)
    if as_radians is None or as_degrees is None:
        return [], None
    if as_degrees.explained > _SURELY_BELONGS and as_degrees.explained > as_radians.explained + 0.2:
        sentence = "The attitude is in degrees: only so do its changes follow from the angular velocity"
        finding = LogFinding("log", "", "refused", sentence, "Write `unit: deg` at the attitude in the mapping")
        return [finding], as_degrees.offset
    findings = _findings("rates", "attitude", ("p", "q", "r"), as_radians, _MOVES["rates"])
    return findings, as_radians.offset


def is_in_degrees(attitude: Series) -> LogFinding | None:
    """A finding where angles cannot be radians: no pitch exceeds a quarter of a turn."""
    pitch = attitude.values[np.isfinite(attitude.values).all(axis=1), 1]
    largest = float(np.percentile(np.abs(pitch), 90)) if len(pitch) else 0.0
    if largest < 1.7:
        return None
    sentence = f"The attitude seems to be in degrees: its pitch reaches {largest:.1f}, and no pitch exceeds 1.57 rad"
    return LogFinding("log", "", "refused", sentence, "Write `unit: deg` at the attitude in the mapping")


def velocity_findings(
    attitude: Stream, position: Stream, velocity: Stream
) -> tuple[list[LogFinding], ClockOffset | None]:
    """Whether the body velocity goes with the position."""
    agreement = agreement_of_steps(attitude, position, velocity)
    if agreement is None:
        return [], None
    turned = _frame_finding(attitude, position, velocity, agreement)
    if turned:
        return [turned], agreement.offset
    findings = _findings("velocity", "position", ("u", "v", "w"), agreement, _MOVES["velocity"])
    down = position[1][:, 2]
    if _is_above(down) and not findings:
        sentence = f"Down of the position is negative, {down.mean():.1f} m on average, as if it were in the air"
        remedy = "If z points up in this log, give its frame in the mapping; else nothing is to be done"
        findings.append(LogFinding("sensor", "position", "note", sentence, remedy))
    return findings, agreement.offset


def _frame_finding(attitude: Stream, position: Stream, velocity: Stream, agreement: Agreement) -> LogFinding | None:
    """Axes of the world that explain what those of the body do not."""
    if _error_of_identity(agreement) < 0.5:
        return None
    north, east, down = position[1].T
    level = (attitude[0], np.tile([1.0, 0.0, 0.0, 0.0], (len(attitude[0]), 1)))
    z_up = (position[0], np.stack([north, east, -down], axis=1))
    enu = (position[0], np.stack([east, north, -down], axis=1))
    trials = (
        ("z of the position points up", "position", "Write a minus before its column in the mapping", attitude, z_up),
        ("The position is in axes east, north, up", "position", "Give its `frame` in the mapping", attitude, enu),
        (
            "The velocity is in world axes, not in those of the body",
            "velocity",
            "Map it as `velocity`",
            level,
            position,
        ),
    )
    for sentence, sensor, remedy, turned, moved in trials:
        trial = agreement_of_steps(turned, moved, velocity)
        if trial is None or trial.explained < _SURELY_BELONGS or _error_of_identity(trial) > 0.3:
            continue
        # A level vehicle does not tell an upward z from a wrong sign of w: then the depth has to.
        if trial.explained > agreement.explained + 0.05 or (moved is z_up and _is_above(down)):
            return LogFinding("sensor", sensor, "left_out", sentence, remedy)
    return None


def _is_above(down: np.ndarray) -> bool:
    return bool(np.mean(down < 0) > 0.9)


def _error_of_identity(agreement: Agreement) -> float:
    """How far the contributions are from those of a unit matrix, on the axes that move."""
    moving = agreement.change > 0.3 * agreement.change.max()
    return float(np.abs(agreement.contributions - np.eye(3))[moving][:, moving].max())


def _findings(sensor: str, pose: str, names: tuple[str, ...], agreement: Agreement, moves: float) -> list[LogFinding]:
    """What the matrix says: swapped columns, signs, degrees, slopes; and what the clock says."""
    moving = agreement.change > max(moves / 2, 0.15 * float(agreement.change.max()))
    if agreement.change.max() < moves:
        return []
    if agreement.explained < _BELONGS:
        share = 100 * max(agreement.explained, 0.0)
        sentence = f"The {WORDS[sensor]} and the {pose} are not of the same motion: {share:.0f} % of it agree"
        return [LogFinding("sensor", sensor, "left_out", sentence, "Check which columns and topics are mapped")]
    findings = []
    is_sure = agreement.explained > _SURELY_BELONGS
    contributions = np.where(np.isfinite(agreement.contributions), agreement.contributions, 0.0)
    rows, columns = scipy.optimize.linear_sum_assignment(-np.abs(contributions))
    for i, j in zip(rows, columns, strict=True):
        strong = abs(contributions[i, j]) > _CONTRIBUTES and abs(contributions[i, i]) < 0.5 * abs(contributions[i, j])
        if i != j and moving[i] and strong and is_sure:
            sentence = f"{names[j]} of the {WORDS[sensor]} is the motion along the axis of {names[i]}, by the {pose}"
            remedy = "Swap the columns in the mapping, or give the frame of the log there"
            findings.append(LogFinding("sensor", f"{sensor}.{names[j]}", "left_out", sentence, remedy))
    swapped = bool(findings)
    for i in np.flatnonzero(moving if not swapped else []):
        findings += _of_slope(sensor, pose, names[i], agreement.matrix[i, i], contributions[i, i])
    if is_sure and agreement.offset.is_worth_saying(_WORTH_SAYING):
        when = "later" if agreement.offset.delay > 0 else "earlier"
        severity = "left_out" if abs(agreement.offset.delay) > _LARGEST_OFFSET else "note"
        sentence = f"The {WORDS[sensor]} comes {agreement.offset} {when} than the {pose}"
        remedy = "Use the times of measurement of both, from one clock"
        findings.append(LogFinding("sensor", sensor, severity, sentence, remedy))
    return findings


def _of_slope(sensor: str, pose: str, name: str, slope: float, contribution: float) -> list[LogFinding]:
    """One number of a velocity, with the factor that takes it to the change of the pose."""
    column = f"{sensor}.{name}"
    if slope < 0 and abs(contribution) > _CONTRIBUTES:
        sentence = f"{name} of the {WORDS[sensor]} has the other sign than the {pose} says (slope {slope:.2f})"
        return [LogFinding("sensor", column, "left_out", sentence, "Write a minus before its column in the mapping")]
    if 1 / _DEGREES[1] < slope < 1 / _DEGREES[0] and sensor == "rates":
        sentence = (
            f"{name} of the angular velocity is in degrees per second: {1 / slope:.0f} times what the attitude says"
        )
        return [LogFinding("sensor", column, "left_out", sentence, "Write `unit: deg/s` in the mapping")]
    if contribution < _CONTRIBUTES:
        sentence = f"{name} of the {WORDS[sensor]} follows the {pose} badly (correlation {contribution:.2f})"
        return [LogFinding("sensor", column, "note", sentence, "Trust the result on this axis less")]
    if not _SLOPES[0] < slope < _SLOPES[1]:
        sentence = f"{name} of the {WORDS[sensor]} is {1 / slope:.2f} times that of the {pose}: smoothed, or scaled"
        return [LogFinding("sensor", column, "note", sentence, "Log what the sensor measures, without a filter")]
    return []
