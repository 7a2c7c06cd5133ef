"""Reads PX4's .ulg files by pyulog."""

import io
from pathlib import Path

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.extra import check_installed, quiet
from undertow.logs.recording import Recording, Table

# Reads at the end of a file from which on pyulog goes round in circles, as it does where the definitions are cut off.
_MOST_AT_END = 1000


class _Stream(io.BytesIO):
    """The bytes of a file, of which pyulog cannot read the end again and again."""

    def __init__(self, data: bytes):
        super().__init__(data)
        self._at_end = 0

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self._at_end += size is not None and len(data) < size
        if self._at_end > _MOST_AT_END:
            raise RuntimeError("the file ends within its definitions")
        return data


def read_px4(path: Path) -> Recording:
    """Tables of the topics; further instances of one as `sensor_combined[1]`.

    Times are those of the sample (`timestamp_sample`) where a topic has them, since the start of the autopilot.

    Raises:
        BadInput: damaged, or pyulog is not installed.
    """
    check_installed("pyulog", "pyulog")
    from pyulog import ULog

    notes: list[str] = []
    stream = _Stream(path.read_bytes())
    try:
        with quiet(notes):
            found = ULog(stream)
        tables = {}
        for data in found.data_list:
            topic = data.name if data.multi_id == 0 else f"{data.name}[{data.multi_id}]"
            tables[topic] = _table(data)
    except Exception as error:  # whatever bytes may cause
        place = 0 if stream.closed else stream.tell()
        got = f"{path.name}, near byte {place}: {str(error) or type(error).__name__}"
        raise BadInput("log", "be an undamaged .ulg file of PX4", got) from None
    if not tables:
        raise BadInput("log", "have topics", f"{path.name}, which has none")
    if found.file_corruption:
        notes.append("parts of the file are damaged or missing, and left out")
    if found.dropouts:
        notes.append(f"{len(found.dropouts)} dropouts while it was recorded")
    return Recording(tables, path.name, "PX4", tuple(notes))


def _table(data) -> Table:
    with np.errstate(invalid="ignore"):  # signalling NaNs
        fields = {name: np.asarray(values, dtype=float) for name, values in data.data.items()}
    sampled = data.data.get("timestamp_sample")
    stamps = data.data["timestamp"] if sampled is None or not sampled.any() else sampled
    return Table(np.asarray(stamps, dtype=float) * 1e-6, fields, data.name)
