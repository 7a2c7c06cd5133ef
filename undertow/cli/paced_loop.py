"""Run a real-time loop whose link sets the pace, for the commands that have one."""

import math
from collections.abc import Callable
from pathlib import Path

from undertow.cli.exit_codes import DONE, FILES_FAILED, complain
from undertow.cli.interruptible import EndingSignal
from undertow.cli.step_logs import logging_to
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.realtime.control_loop import RealTimeLoop
from undertow.outside.realtime.link import AbstractPacingLink
from undertow.outside.realtime.loop_clock import MonotonicClock
from undertow.outside.realtime.loop_settings import LoopSettings


def run_until_signal(
    autopilot: Autopilot,
    link: AbstractPacingLink,
    settings: LoopSettings,
    duration: float | None,
    report: Callable[[str], None],
    log: Path | None,
) -> int:
    """Control for so many seconds (None: without end), or until a signal ends it; return the exit code.

    A line per second, and one at the end, go to `report`; every step to a log, where one is given.
    """
    stop, troubles = EndingSignal(), list[str]()
    loop = RealTimeLoop(autopilot, link, MonotonicClock(), settings, stop.asked, report=report)
    periods = math.inf if duration is None else duration / autopilot.sampling_time
    with logging_to(log, autopilot, troubles):
        try:
            with stop.listening():
                loop.run(periods=periods)
        finally:
            report(f"Ended: {loop.counts_line(link)}. The last command is the safe output")
    for trouble in troubles:
        complain(trouble)
    return stop.exit_code or (FILES_FAILED if troubles else DONE)
