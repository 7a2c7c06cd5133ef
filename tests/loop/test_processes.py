"""Tasks of the reproduction side by side: where they are computed, and what becomes of errors and lost processes."""

import math
import os
import signal
import threading
import time

import pytest

from undertow.core.errors import BadInput
from undertow.simulation import processes as module
from undertow.simulation.processes import Tasks, worker_processes

pytestmark = pytest.mark.full


def both(pool, function, *arguments):
    """Results of a function from two tasks at the same time: each process computes one."""
    tasks = [pool.submit(slowly, function, arguments) for _ in range(2)]
    return [task.result(60) for task in tasks]


def slowly(function, arguments):
    time.sleep(0.5)
    return function(*arguments)


def refuse():
    raise BadInput("sets", "be positive", "0")


def test_two_processes_compute_and_raise_and_one_goes_on_alone():
    with worker_processes(2) as pool:
        numbers = set(both(pool, os.getpid))
        assert len(numbers) == 2 and os.getpid() in numbers
        assert both(pool, math.factorial, 20) == [2432902008176640000] * 2
        for task in [pool.submit(slowly, refuse, ()) for _ in range(2)]:
            with pytest.raises(BadInput, match="`sets` must be positive, but is 0"):
                task.result(60)
        assert set(both(pool, os.getpid)) == numbers, "an error ends no process"
        (other,) = numbers - {os.getpid()}
        os.kill(other, signal.SIGKILL)
        assert both(pool, os.getpid) == [os.getpid()] * 2


def test_one_process_is_this_one(monkeypatch):
    monkeypatch.setattr(module, "_cores", lambda: 1)
    with worker_processes() as pool:
        assert both(pool, os.getpid) == [os.getpid()] * 2


def test_an_error_cancels_what_has_not_begun():
    held, futures = threading.Event(), []
    with pytest.raises(KeyboardInterrupt), worker_processes(1) as pool:
        futures += [pool.submit(held.wait, 60), pool.submit(math.sqrt, 4.0)]
        raise KeyboardInterrupt
    held.set()
    assert futures[1].cancelled() and futures[0].result(60) is True


def test_progress_counts_the_tasks_that_are_done():
    said = []
    with worker_processes(1) as pool:
        held = threading.Event()
        tasks = Tasks(pool, lambda words, share: said.append((words, share)))
        begun = [tasks.submit("waited", held.wait, 60), tasks.submit("a root", math.sqrt, 4.0)]
        begun.append(tasks.submit("refused", refuse))
        held.set()
        assert begun[1].result(60) == 2.0
        with pytest.raises(BadInput):
            begun[2].result(60)
    assert said == [("waited", pytest.approx(1 / 3)), ("a root", pytest.approx(2 / 3))]
