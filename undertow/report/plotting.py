"""Figures of a run, plotted by a process of their own while this one goes on.

Starting matplotlib takes as long as the start of JAX, and plotting as long as the prediction; a process that is started
with the command does both on another core.
"""

import contextlib
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from undertow.report import figures
from undertow.report.plotted import Plotted
from undertow.scenario.results.netcdf import read_record


class PlottingProcess:
    """A process that plots one run.

    Args:
        process: runs `serve`; None where figures are plotted by this process.
    """

    def __init__(self, process: subprocess.Popen[bytes] | None):
        self._process = process
        self._request: tuple[Path, str | None] | None = None

    def plot(self, run: Path, width: str | None) -> None:
        """Begin to plot the run in a file `run.nc`, with PDF files where a width is given."""
        self._request = run, width
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError):  # it has ended; `plotted` then plots here
                self._process.stdin.write(pickle.dumps(self._request))
                self._process.stdin.close()

    def plotted(self) -> Plotted:
        """Wait for the figures; plotted here where the process cannot.

        Raises:
            UnreadableResult: the file of the run cannot be read.
        """
        assert self._request is not None, "`plot` comes first"
        if self._process is not None and self._process.stdout is not None:
            data = self._process.stdout.read()
            if self._process.wait() == 0 and data:
                return pickle.loads(data)  # written by our own process
        return _plot(*self._request)


@contextlib.contextmanager
def plotting_process() -> Iterator[PlottingProcess]:
    """A process that has matplotlib ready when the run has ended; this one where matplotlib is loaded here already."""
    if "matplotlib" in sys.modules or not sys.executable:
        yield PlottingProcess(None)
        return
    # The same search path, but without the current folder in front, where a file may have the name of a module. Ctrl-C
    # ends this process, which ends the other one.
    command = f"import sys; sys.path[:] = {sys.path!r}; from undertow.report.plotting import serve; serve()"
    pipe = subprocess.PIPE
    try:
        process = subprocess.Popen([sys.executable, "-c", command], stdin=pipe, stdout=pipe, start_new_session=True)
    except OSError:
        yield PlottingProcess(None)
        return
    with process:  # closes the pipes and waits
        try:
            yield PlottingProcess(process)
        finally:
            process.kill()


def serve() -> None:
    """Plot the run whose file standard input names, and write the figures to standard output.

    Whatever else is printed goes to standard error.
    """
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    _ = figures.plot_run  # imports matplotlib before there is anything to do
    request = sys.stdin.buffer.read()
    if request:
        pickle.dump(_plot(*pickle.loads(request)), answer)
        answer.close()


def _plot(run: Path, width: str | None) -> Plotted:
    return figures.plot_run(read_record(run), width)
