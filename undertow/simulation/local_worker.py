"""Preload of Dask workers on this machine: they ignore Ctrl-C, and the main process ends them."""

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Called by Dask in every worker process that starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
