"""A log that can be saved."""

from dataclasses import dataclass
from pathlib import Path

from undertow.core.atomic_io import replacing
from undertow.core.errors import BadInput
from undertow.logs.csv_writer import write_csv
from undertow.logs.log_signals import LogSignals
from undertow.logs.mcap_writer import write_mcap

_WRITERS = {".mcap": write_mcap, ".csv": write_csv}


@dataclass(frozen=True, repr=False)
class Log(LogSignals):
    """Signals of a run or of a vehicle, as readers give them."""

    def save(self, path: str | Path) -> None:
        """Write all signals to a file: .mcap, which keeps everything, or .csv, which keeps the numbers.

        The file appears whole or not at all; one that was there stays until then.

        Raises:
            BadInput: another kind of file.
            OSError: it cannot be written.
        """
        path = Path(path)
        if path.suffix not in _WRITERS:
            raise BadInput("path", f"be a file whose name ends in {' or '.join(_WRITERS)}", str(path))
        with replacing(path) as file:
            _WRITERS[path.suffix](self, file)
