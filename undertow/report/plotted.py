"""Figures of a run as they are written and shown."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple


class Plotted(NamedTuple):
    """Figures of a run.

    Attributes:
        files: what the files hold, by their names.
        pictures: what the page shows: PNG, by the name of the figure.
        failures: a sentence for each figure that could not be made.
    """

    files: Mapping[str, bytes]
    pictures: Mapping[str, bytes]
    failures: list[str]

    def write(self, folder: Path) -> None:
        """Write the files into a folder, which is made if need be.

        Raises:
            OSError: the folder cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in self.files.items():
            (folder / name).write_bytes(data)
