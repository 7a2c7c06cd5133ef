"""Reads PX4's .ulg files by pyulog."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.extra import check_installed, quiet
from undertow.logs.recording import Recording, TopicMessages

# Reads at the end of a file from which on pyulog goes round in circles, as it does where the definitions are cut off.
_MOST_AT_END = 1000

# Numbers of a topic, and of all topics. Arrays of arrays in a file of a hundred bytes could be billions.
_MOST_FIELDS, _MOST_IN_ALL = 2**16 - 1, 2**18


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
    notes: list[str] = []
    stream = _Stream(path.read_bytes())
    try:
        with quiet(notes):
            log = _parsed(stream)
        tables = {}
        for data in log.data_list:
            topic = data.name if data.multi_id == 0 else f"{data.name}[{data.multi_id}]"
            tables[topic] = _table(data)
    except Exception as error:  # whatever bytes may cause
        offset = 0 if stream.closed else stream.tell()
        got = f"{path.name}, near byte {offset}: {str(error) or type(error).__name__}"
        raise BadInput("log", "be an undamaged .ulg file of PX4", got) from None
    if not tables:
        raise BadInput("log", "have topics", f"{path.name}, which has none")
    if log.file_corruption:
        notes.append("parts of the file are damaged or missing, and left out")
    if log.dropouts:
        notes.append(f"{len(log.dropouts)} dropouts while it was recorded")
    return Recording(tables, path.name, "PX4", tuple(notes))


def _parsed(stream: _Stream) -> Any:
    """What pyulog makes of a file whose topics are not too large."""
    from pyulog import ULog

    sizes: dict[str, int] = {}
    total = 0

    class Checked(ULog):
        class _MessageAddLogged(ULog._MessageAddLogged):
            def _parse_format(self, message_formats):
                nonlocal total
                size = _fields(self.message_name, message_formats, sizes)
                total += size
                if size > _MOST_FIELDS or total > _MOST_IN_ALL:
                    most = f"{_MOST_FIELDS} of a topic and {_MOST_IN_ALL} in all"
                    raise RuntimeError(
                        f"{self.message_name} has {size} fields, {total} with those before; {most} are read"
                    )
                super()._parse_format(message_formats)

    return Checked(stream)


def _fields(name: str, formats: Any, sizes: dict[str, int]) -> int:
    """Number of the fields of a format, those of the formats within it included; 1 for one that is not described."""
    if name not in formats:
        return 1
    if name not in sizes:
        sizes[name] = sum(max(1, count) * _fields(kind, formats, sizes) for kind, count, _ in formats[name].fields)
    return sizes[name]


def _table(data) -> TopicMessages:
    with np.errstate(invalid="ignore"):  # signalling NaNs
        fields = {name: np.asarray(values, dtype=float) for name, values in data.data.items()}
    sampled = data.data.get("timestamp_sample")
    stamps = data.data["timestamp"] if sampled is None or not sampled.any() else sampled
    return TopicMessages(np.asarray(stamps, dtype=float) * 1e-6, fields, data.name)
