"""Figures of a run, plotted by a process of their own while this one goes on.

Starting matplotlib takes as long as the start of JAX, and plotting as long as the prediction; a process that is started
with the command does both on another core.
"""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

from undertow.core.process_setup import python_command
from undertow.report import figures
from undertow.report.plotted import Plotted


class PlottingProcess:
    """A process that plots one run.

    Args:
        process: runs `serve`; None where figures are plotted by this process.
    """

    def __init__(self, process: subprocess.Popen[bytes] | None):
        self._process = process
        self._request: tuple[Any, ...] | None = None
        self._sending: threading.Thread | None = None

    def plot(self, *run: Any) -> None:
        """Begin to plot a run; arguments of `figures.plot_run`."""
        self._request = run
        if self._process is not None:
            # The process may still be starting, and a pipe holds little.
            self._sending = threading.Thread(target=self._send, daemon=True)
            self._sending.start()

    def _send(self) -> None:
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(OSError):  # it has ended; `plotted` then plots here
            self._process.stdin.write(pickle.dumps(self._request))
            self._process.stdin.close()

    def plotted(self) -> Plotted:
        """Wait for the figures; plotted here where the process cannot."""
        assert self._request is not None, "`plot` comes first"
        if self._process is not None and self._sending is not None and self._process.stdout is not None:
            self._sending.join()
            data = self._process.stdout.read()
            if self._process.wait() == 0 and data:
                return pickle.loads(data)  # written by our own process
        return figures.plot_run(*self._request)


@contextlib.contextmanager
def plotting_process() -> Iterator[PlottingProcess]:
    """A process that has matplotlib ready when the run has ended; this one where matplotlib is loaded here already."""
    if "matplotlib" in sys.modules or not sys.executable:
        yield PlottingProcess(None)
        return
    # It lives for seconds, of which looking for garbage would be a fifth.
    command = python_command(f"import gc; gc.disable(); from {__name__} import serve; serve()")
    pipe = subprocess.PIPE
    try:
        # Ctrl-C ends this process, which ends the other one.
        process = subprocess.Popen(command, stdin=pipe, stdout=pipe, start_new_session=True)
    except OSError:
        yield PlottingProcess(None)
        return
    with process:  # closes the pipes and waits
        try:
            yield PlottingProcess(process)
        finally:
            process.kill()


def serve() -> None:
    """Plot the run that standard input holds, pickled, and write the figures to standard output.

    Whatever else is printed goes to standard error.
    """
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    _ = figures.plot_run  # imports matplotlib before there is anything to do
    request = sys.stdin.buffer.read()
    if request:
        pickle.dump(figures.plot_run(*pickle.loads(request)), answer)
        answer.close()
    os._exit(0)  # at once: taking everything apart would take as long as two figures
