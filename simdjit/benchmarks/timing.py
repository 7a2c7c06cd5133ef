"""Processor time on one core, on which other processes have little effect. Import it before what counts the cores."""

import os
import time
from collections.abc import Callable
from typing import Any

if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, list(os.sched_getaffinity(0))[:1])

REPETITIONS = 5


def shortest(work: Callable[[], Any]) -> float:
    """Seconds, of some repetitions after a first one."""
    work()
    times = []
    for _ in range(REPETITIONS):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)
