"""Priority and processor of the thread that runs a loop."""

import contextlib
import os
import threading
from collections.abc import Iterator

from undertow.core.errors import BadInput


@contextlib.contextmanager
def scheduled(priority: int | None, processor: int | None) -> Iterator[None]:
    """Run the calling thread before others, or on one processor, and give both back at the end.

    Python's other threads, such as that which writes a log, follow at the next lower priority: one that holds Python's
    lock and gets no processor would hold up the caller.

    Args:
        priority: of SCHED_FIFO, 1 to 99; None to leave it.
        processor: number; None for any.

    Raises:
        BadInput: the system has no such thing, or does not permit it.
    """
    scheduler, processors = _scheduler(priority), _processors(processor)
    native_ids = {python_thread.native_id for python_thread in threading.enumerate() if python_thread.native_id}
    followers = native_ids - {threading.get_native_id()}
    try:
        _prioritize(priority, followers)
        if processor is not None:
            os.sched_setaffinity(0, {processor})
        yield
    finally:
        if scheduler is not None:
            for thread in (0, *followers):
                with contextlib.suppress(OSError):  # it may have ended
                    os.sched_setscheduler(thread, *scheduler)
        with contextlib.suppress(OSError):
            if processors is not None:
                os.sched_setaffinity(0, processors)


def _scheduler(priority: int | None) -> tuple[int, os.sched_param] | None:
    """The scheduler as it is, to be restored; None where it is not changed."""
    if priority is None:
        return None
    if not hasattr(os, "sched_setscheduler"):
        raise BadInput("--priority", "be left out on a system without SCHED_FIFO", priority)
    if not 1 <= priority <= 99:
        raise BadInput("--priority", "be from 1 to 99", priority)
    return os.sched_getscheduler(0), os.sched_getparam(0)


def _processors(processor: int | None) -> set[int] | None:
    """Processors that are used now, to be restored; None where they are not changed."""
    if processor is None:
        return None
    if not hasattr(os, "sched_setaffinity"):
        raise BadInput("--cpu", "be left out on a system that cannot bind threads to processors", processor)
    allowed = os.sched_getaffinity(0)
    if processor not in allowed:
        raise BadInput("--cpu", f"be one of {', '.join(map(str, sorted(allowed)))}", processor)
    return allowed


def _prioritize(priority: int | None, followers: set[int]) -> None:
    if priority is None:
        return
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        hint = "Permit it with `ulimit -r 99`, rtprio in /etc/security/limits.conf, or the capability CAP_SYS_NICE"
        raise BadInput("--priority", "be permitted by the system", f"{priority}, which is not", hint=hint) from None
    for thread in followers:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(max(priority - 1, 1)))
