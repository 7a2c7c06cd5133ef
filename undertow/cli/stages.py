"""Live progress: the current stage and its elapsed time."""

import contextlib
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


@contextlib.contextmanager
def stage(console: Console, name: str) -> Iterator[None]:
    """Show a stage with its elapsed time, and leave one line when it is finished; none if it fails."""
    started = time.perf_counter()
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        live.add_task(name)
        yield
    console.print(f"{name:<24}{time.perf_counter() - started:6.1f} s", highlight=False)


def new_lines(console: Console) -> Callable[[str], None]:
    """A function that prints a line unless it is the one before."""
    last = ""

    def say(words: str) -> None:
        nonlocal last
        if words != last:
            last = words
            console.print(words, highlight=False)

    return say


@contextlib.contextmanager
def live_stages(console: Console) -> Iterator[Callable[[str], None]]:
    """A function that shows the current stage, with the time since the begin; as lines where there is no terminal."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("starting")

        def say(stage: str) -> None:
            live.update(task, description=stage)
            if not console.is_terminal:
                console.print(stage, highlight=False)

        yield say


@contextlib.contextmanager
def shares(console: Console, remaining: bool = False) -> Iterator[Callable[[str, float], None]]:
    """A function that shows a message and the share done: as a bar on a terminal, as lines elsewhere.

    The remaining time can be shown too, for work that proceeds evenly.
    """
    remaining_columns = (TextColumn("left"), TimeRemainingColumn()) if remaining else ()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        *remaining_columns,
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("starting", total=1.0)

        def progress(message: str, share: float) -> None:
            live.update(task, description=message, completed=share)
            if not console.is_terminal:
                console.print(f"{share:4.0%} {message}", highlight=False)

        yield progress
