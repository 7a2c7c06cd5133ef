"""Live progress: what is being done, and for how long."""

import contextlib
import time
from collections.abc import Iterator

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class Stages:
    """Names the stage in progress with its elapsed time, and leaves one line for each that is done."""

    def __init__(self, console: Console):
        self.console = console

    @contextlib.contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """One stage; nothing is left of one that fails."""
        started = time.perf_counter()
        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=self.console, transient=True, disable=not self.console.is_terminal) as live:
            live.add_task(name)
            yield
        self.console.print(f"{name:<24}{time.perf_counter() - started:6.1f} s", highlight=False)
