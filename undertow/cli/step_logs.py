"""The log of the steps of a controller, while a command runs it."""

import contextlib
import warnings
from collections.abc import Iterator
from pathlib import Path

from undertow.outside.autopilot.autopilot import Autopilot


@contextlib.contextmanager
def logging_to(path: Path | None, autopilot: Autopilot, troubles: list[str]) -> Iterator[None]:
    """Inside, an autopilot logs its steps to a .mcap file; None for none.

    What goes wrong with the log is added to `troubles`: it does not stop the controller.

    Raises:
        BadInput: the file cannot be written at the beginning.
    """
    if path is None:
        yield
        return
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        try:
            autopilot.log_to(path)
            yield
        finally:
            autopilot.close_log()
            troubles.extend(str(warning.message) for warning in noted)
