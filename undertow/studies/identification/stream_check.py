"""How the streams of a log were sampled: rate, gaps, dead, stuck and repeated numbers, outliers."""

from collections.abc import Iterator

import numpy as np

from undertow.logs.log_signals import LogSignals, Series
from undertow.studies.identification.finding import WORDS, LogFinding
from undertow.studies.identification.outliers import outliers

# Names that a sensor has in a log, the one that is used first.
SIGNALS_OF_SENSOR = {
    "position": ("measured_position", "position"),
    "attitude": ("attitude",),
    "velocity": ("body_velocity", "measured_velocity", "velocity"),
    "rates": ("angular_velocity",),
    "depth": ("depth",),
}

_FEWEST = 20
_SLOW = 4.0  # Hz
_LONGEST_GAP = 1.0  # s
_SHARE_OF_GAPS = 0.2
_UNEVEN = 0.5  # standard deviation of the intervals over their median
_MISSING = 0.2
_DEAD, _ABSURD = 1e-12, 1e9
_DEAD_RATES = 1e-5  # rad/s: the noise of any gyro is larger
_COVERED = 0.5
_STUCK = 3.0  # s
_STUCK_SHARE = 0.1
_REPEATED = 0.3
_OUTLIERS, _TOO_MANY = 0.02, 0.25


def sensor_series(log: LogSignals) -> dict[str, Series]:
    """The signal of each sensor that a log has, as logged."""
    series = {
        sensor: next(log[name] for name in names if name in log)
        for sensor, names in SIGNALS_OF_SENSOR.items()
        if any(name in log for name in names)
    }
    pose = series.get("position")
    if pose is not None and pose.values.shape[1:] == (6,):
        series["attitude"] = pose._replace(values=pose.values[:, 3:], columns=pose.columns[3:])
        series["position"] = pose._replace(values=pose.values[:, :3], columns=pose.columns[:3])
    if "position" in series:
        series.pop("depth", None)
    return series


def stream_findings(series: dict[str, Series], duration: float) -> list[LogFinding]:
    """What is strange about the streams of the sensors of a log of a duration in s."""
    findings: list[LogFinding] = []
    for sensor, stream in series.items():
        unusable = _unusable(sensor, stream)
        findings += [unusable] if unusable else [*_sampling(sensor, stream, duration), *_numbers(sensor, stream)]
    return findings


def _unusable(sensor: str, stream: Series) -> LogFinding | None:
    """Why nothing can be done with a stream."""
    values = stream.values.reshape(-1, len(stream.column_names())).astype(float)
    finite = values[np.isfinite(values).all(axis=1)]
    leave = "Leave it out of the mapping, or map the column that holds it"
    if len(finite) < _FEWEST:
        sentence = f"Of {len(values)} samples of the {WORDS[sensor]} {len(finite)} are numbers; {_FEWEST} are needed"
        return LogFinding("sensor", sensor, "left_out", sentence, leave)
    if (np.abs(finite) < (_DEAD_RATES if sensor == "rates" else _DEAD)).all():
        sentence = f"The {WORDS[sensor]} is dead: no number in it is larger than {np.abs(finite).max():.0e}"
        return LogFinding("sensor", sensor, "left_out", sentence, leave)
    if np.abs(finite).max() > _ABSURD:
        sentence = f"The {WORDS[sensor]} has numbers as large as {np.abs(finite).max():.0e}"
        return LogFinding("sensor", sensor, "left_out", sentence, leave)
    if _is_constant(finite).all():
        return LogFinding("sensor", sensor, "left_out", f"The {WORDS[sensor]} never changes", leave)
    longest, begin = _longest_repetition(stream.time, values)
    duration = stream.time[-1] - stream.time[0]
    if longest > max(_STUCK, _STUCK_SHARE * duration):
        sentence = f"The {WORDS[sensor]} is stuck: from {begin:.1f} s on it does not change for {longest:.1f} s"
        return LogFinding("sensor", sensor, "left_out", sentence, "Cut the log to the time in which it works")
    return None


def _sampling(sensor: str, stream: Series, duration: float) -> Iterator[LogFinding]:
    covered = float(stream.time[-1] - stream.time[0]) / duration
    if covered < _COVERED:
        sentence = f"The {WORDS[sensor]} covers {100 * covered:.0f} % of the log"
        yield LogFinding("sensor", sensor, "note", sentence, "Look why it was not logged, or cut the log to that time")
    steps = np.diff(stream.time)
    median = float(np.median(steps))
    rate = len(steps) / float(stream.time[-1] - stream.time[0])
    if rate < _SLOW:
        sentence = f"The {WORDS[sensor]} comes at {rate:.1f} Hz; what takes less than {2 / rate:.1f} s is not seen"
        yield LogFinding("sensor", sensor, "note", sentence, "Log it at 10 Hz or more")
    gaps = steps[steps > max(_LONGEST_GAP, 5 * median)]
    if len(gaps):
        share = gaps.sum() / steps.sum()
        sentence = (
            f"The {WORDS[sensor]} has {len(gaps)} gaps, {100 * share:.0f} % of the time, up to {gaps.max():.1f} s"
        )
        severity = "left_out" if share > 0.5 else "note"
        if share > _SHARE_OF_GAPS or gaps.max() > 5 * _LONGEST_GAP:
            yield LogFinding("sensor", sensor, severity, sentence, "Look for a full link or disk, or cut the log there")
    short = steps[steps <= max(_LONGEST_GAP, 5 * median)]
    if len(short) and short.std() > _UNEVEN * median and rate < 50:
        sentence = f"Samples of the {WORDS[sensor]} come unevenly: every {median:.3f} s +- {short.std():.3f} s"
        yield LogFinding("sensor", sensor, "note", sentence, "Log the time of the measurement, not that of reception")


def _numbers(sensor: str, stream: Series) -> Iterator[LogFinding]:
    values = stream.flat().astype(float)
    is_finite = np.isfinite(values).all(axis=1)
    missing = 1 - is_finite.mean()
    if missing > _MISSING:
        sentence = f"In {100 * missing:.0f} % of the samples of the {WORDS[sensor]} there are numbers missing"
        yield LogFinding("sensor", sensor, "note", sentence)
    finite = values[is_finite]
    for name, is_constant in zip(stream.column_names(), _is_constant(finite), strict=True):
        if is_constant and name != "yaw":
            sentence = f"{name} of the {WORDS[sensor]} never changes, while its other numbers do"
            yield LogFinding(
                "sensor", f"{sensor}.{name}", "left_out", sentence, "Check which column of the log holds it"
            )
    repeated = (np.diff(finite, axis=0) == 0).all(axis=1).mean()
    if repeated > _REPEATED:
        rate = (1 - repeated) * len(finite) / float(stream.time[-1] - stream.time[0])
        sentence = (
            f"{100 * repeated:.0f} % of the samples of the {WORDS[sensor]} are repeated; new ones come at {rate:.1f} Hz"
        )
        yield LogFinding(
            "sensor", sensor, "note", sentence, "Log it at that rate: repeated samples look like better ones"
        )
    longest, begin = _longest_repetition(stream.time, values)
    if longest > _STUCK:
        sentence = f"From {begin:.1f} s on the {WORDS[sensor]} does not change for {longest:.1f} s"
        yield LogFinding("sensor", sensor, "note", sentence, "If the vehicle moved then, cut the log there")


def outlier_findings(measured: dict[str, tuple[np.ndarray, np.ndarray]]) -> list[LogFinding]:
    """Sensors with many samples far from their neighbours; attitudes as quaternions."""
    findings = []
    for sensor, (_, values) in measured.items():
        share = float(outliers(values).mean()) if len(values) > _FEWEST else 0.0
        if share > _OUTLIERS:
            sentence = f"{100 * share:.0f} % of the samples of the {WORDS[sensor]} lie far from those before and after"
            severity = "left_out" if share > _TOO_MANY else "note"
            remedy = "Filter them out before, or improve the sensor" if share > _TOO_MANY else ""
            findings.append(LogFinding("sensor", sensor, severity, sentence, remedy))
    return findings


def _is_constant(values: np.ndarray) -> np.ndarray:
    return np.ptp(values, axis=0) <= 1e-9 * np.maximum(np.abs(values).max(axis=0), _DEAD)


def _longest_repetition(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Longest time in s over which all numbers stay the same, and its begin after that of the log."""
    changes = np.flatnonzero((np.diff(values, axis=0) != 0).any(axis=1)) + 1
    edges = np.concatenate([[0], changes, [len(values)]])
    last = np.minimum(edges[1:], len(values)) - 1
    spans = time[last] - time[edges[:-1]]
    longest = int(np.argmax(spans))
    return float(spans[longest]), float(time[edges[longest]] - time[0])
