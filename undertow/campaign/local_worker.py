"""What a Dask worker on this machine does first: Ctrl-C is for the process that conducts, which ends its workers."""

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Called by Dask in every worker process that starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
