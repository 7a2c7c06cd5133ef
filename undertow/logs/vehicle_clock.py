"""Times of MAVLink messages by the clock of the vehicle, which know nothing of the delays of the link.

A message has the time since the vehicle started, and the ground station notes when it came. The vehicle started, on the
axis of the ground station, when the message says that came fastest.
"""

from collections.abc import Mapping

import numpy as np

from undertow.logs.recording import TopicMessages, rows_of

_MILLISECONDS, _MICROSECONDS = "time_boot_ms", "time_usec"
_WRAP = 2**32 * 1e-6  # s after which microseconds of 32 bits begin again, as those of SERVO_OUTPUT_RAW
_RESTART = 5.0  # s by which the clock goes back where the vehicle started again
_LATE = 10.0  # s; a message that differs by more has another time than that since the start


def on_vehicle_clock(tables: Mapping[str, TopicMessages]) -> tuple[dict[str, TopicMessages], int]:
    """The tables of a vehicle with the times of its own clock, and how often it started again.

    Args:
        tables: by type of message, with times of the ground station, s. Messages without a time keep these.
    """
    clocks = {
        name: 1e-3 * table.fields[_MILLISECONDS] for name, table in tables.items() if _MILLISECONDS in table.fields
    }
    if not clocks:
        return dict(tables), 0
    received = np.concatenate([tables[name].time for name in clocks])
    clock = np.concatenate(list(clocks.values()))
    order = np.argsort(received, kind="stable")
    begins = _starts(received[order], clock[order])
    session = np.searchsorted(begins, received, side="right") - 1
    zeros = np.full(len(begins), np.inf)
    np.minimum.at(zeros, session, received - clock)
    return {name: _timed(table, clocks.get(name), begins, zeros) for name, table in tables.items()}, len(begins) - 1


def _timed(table: TopicMessages, clock: np.ndarray | None, begins: np.ndarray, zeros: np.ndarray) -> TopicMessages:
    """A table on the clock of the vehicle, in the order of its times."""
    zero = zeros[np.searchsorted(begins, table.time, side="right") - 1]
    if clock is None and _MICROSECONDS in table.fields:
        clock = 1e-6 * table.fields[_MICROSECONDS]
        clock = clock + _WRAP * np.round((table.time - zero - clock) / _WRAP)
    if clock is None or np.median(np.abs(clock + zero - table.time)) > _LATE:
        return table
    time = clock + zero
    return rows_of(table._replace(time=time), np.argsort(time, kind="stable"))


def _starts(received: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Times of the ground station from which on the clock counts anew; the first is before all others."""
    begins = [-np.inf]
    highest = -np.inf
    for time, reading in zip(received.tolist(), clock.tolist(), strict=True):
        if reading < highest - _RESTART:
            begins.append(time)
            highest = reading
        highest = max(highest, reading)
    return np.array(begins)
