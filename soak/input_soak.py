"""Hostile inputs by the thousand: processes that try them, and the count of what they did."""

import contextlib
import multiprocessing
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from soak.input_runner import Run, work
from soak.inputs import Attack, attack, planned
from soak.verdict import REFUSED, Done, Failure, failure_of

_LATEST = 300.0  # s without an answer, after which a process is ended
_FRESH = 1500  # inputs after which a process is replaced: compiled code of every shape stays in memory


class Tried(NamedTuple):
    """Result of hostile inputs.

    Attributes:
        counts: inputs by kind and ending: accepted, refused, failed.
        failures: never-events, each with its input.
        slowest: processor time of the slowest rejection, s.
        messages: how many different errors there were, without numbers and quoted values.
        seconds: elapsed time.
    """

    counts: dict[str, dict[str, int]]
    failures: list[tuple[Failure, Attack]]
    slowest: float
    messages: int
    seconds: float

    @property
    def number(self) -> int:
        """Inputs that were tried."""
        return sum(sum(of_kind.values()) for of_kind in self.counts.values())


class _Worker:
    """A process that tries inputs; a new one where the old one died."""

    def __init__(self, run: Run, seed: int, material: Mapping[str, bytes], folder: Path):
        self._arguments = (run, seed, material, str(folder))
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, sender = context.Pipe()
        self._process = context.Process(target=work, args=(*self._arguments, sender), daemon=True)
        self._process.start()
        sender.close()
        self.asked: tuple[str, int] | None = None
        self.since = time.monotonic()
        self._tried = 0

    def ask(self, task: tuple[str, int]) -> None:
        """Let it try an input."""
        if self._tried >= _FRESH:
            self.end()
            self._start()
        self.asked, self.since, self._tried = task, time.monotonic(), self._tried + 1
        self.pipe.send(task)

    def restart(self) -> str:
        """End the process and start another; how it ended."""
        self._process.join(1.0)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        self.pipe.close()
        self._start()
        return "no answer" if code is None else f"exit code {code} of the process"

    def end(self) -> None:
        """Let it end by itself."""
        with contextlib.suppress(OSError):
            self.pipe.send(None)
        self._process.join(5.0)
        self._process.kill()
        self.pipe.close()


def try_inputs(
    run: Run,
    number: int,
    seed: int,
    material: Mapping[str, bytes],
    folder: Path,
    workers: int = 2,
    until: float = float("inf"),
    watch: Callable[[int, int], None] = lambda done, failed: None,
) -> Tried:
    """Try so many hostile inputs.

    Args:
        run: `undertow` with arguments, in the process that calls it.
        number: how many.
        seed: of all of them.
        material: valid binary files, by name.
        folder: for the files of the inputs.
        workers: processes.
        until: time of `time.monotonic` after which no more are tried.
        watch: called with the numbers of inputs and failures so far.
    """
    began = time.monotonic()
    tasks = iter(planned(number))
    counts: dict[str, Counter[str]] = {}
    failures: list[tuple[Failure, Attack]] = []
    slowest = 0.0
    messages = set()
    total = 0
    processes = [_Worker(run, seed, material, folder / f"w{i}") for i in range(workers)]
    try:
        for hostile_input, outcome in _answers(processes, tasks, seed, material, until):
            failure = failure_of(hostile_input.identity, hostile_input.arguments, hostile_input.files, outcome)
            ending = "failed" if failure else "refused" if outcome.code in REFUSED else "accepted"
            counts.setdefault(hostile_input.identity.split("/")[1], Counter())[ending] += 1
            total += 1
            if failure:
                failures.append((failure, hostile_input))
            elif ending == "refused":
                slowest = max(slowest, outcome.seconds[0])
                messages.add(_shape(outcome.err))
            watch(total, len(failures))
    finally:
        for process in processes:
            process.end()
    plain = {kind: dict(counted) for kind, counted in sorted(counts.items())}
    return Tried(plain, failures, slowest, len(messages), time.monotonic() - began)


def _answers(
    processes: Sequence[_Worker],
    tasks: Iterator[tuple[str, int]],
    seed: int,
    material: Mapping[str, bytes],
    until: float,
) -> Iterator[tuple[Attack, Done]]:
    """Every input with what it did, as they end."""
    busy: dict[Any, _Worker] = {}
    idle = list(processes)
    while True:
        while idle and time.monotonic() < until and (task := next(tasks, None)) is not None:
            worker = idle.pop()
            worker.ask(task)
            busy[worker.pipe] = worker
        if not busy:
            return
        ready: list[Connection] = wait(list(busy), 1.0)  # pyright: ignore[reportAssignmentType]
        overdue = [pipe for pipe, worker in busy.items() if time.monotonic() - worker.since > _LATEST]
        for pipe in {*ready, *overdue}:
            worker = busy.pop(pipe)
            task_of_worker = worker.asked
            assert task_of_worker is not None
            try:
                if pipe not in ready:
                    raise EOFError
                answer = worker.pipe.recv()
            except (EOFError, OSError):
                elapsed = time.monotonic() - worker.since
                cause = worker.restart()
                answer = attack(*_known(task_of_worker, seed), material), Done(None, "", cause, (elapsed, elapsed), ())
            idle.append(worker)
            yield answer


def _known(task: tuple[str, int], seed: int) -> tuple[str, int, int]:
    return task[0], seed, task[1]


def _shape(err: str) -> str:
    """An error without what differs from input to input."""
    import re

    return re.sub(r"`[^`]*`|'[^']*'|[\d.+-]+|but is .*", "", err)[:120]
