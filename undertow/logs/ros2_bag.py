"""Reads bags of ROS 2 by rosbags: a folder with metadata.yaml, or a .db3 or .mcap file of one."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.extra import check_installed, quiet
from undertow.logs.recording import Recording, Table

_LONGEST = 64  # numbers of an array that become columns; images and point clouds have more


def read_ros2_bag(path: Path) -> Recording:
    """Tables of the numbers of each topic, by path: `pose.pose.position.x`, `data[3]`.

    Times are those of the header where a message has a stamp, otherwise those of recording; both since the first.

    Raises:
        BadInput: damaged, a message of unknown type only, or rosbags is not installed.
    """
    check_installed("rosbags", "rosbags")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    notes: list[str] = []
    stamps: dict[str, list[int]] = {}
    rows: dict[str, list[dict[str, float]]] = {}
    kinds: dict[str, str] = {}
    unknown: set[str] = set()
    place = "its beginning"
    try:
        with quiet(notes), AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            for connection, recorded, raw in reader.messages():
                place = f"the message of {connection.topic} at {recorded} ns"
                if connection.msgtype not in reader.typestore.fielddefs:
                    unknown.add(f"{connection.topic} ({connection.msgtype})")
                    continue
                message = reader.deserialize(raw, connection.msgtype)
                kinds[connection.topic] = connection.msgtype
                stamps.setdefault(connection.topic, []).append(_stamp(message) or recorded)
                rows.setdefault(connection.topic, []).append(dict(_leaves(message, "")))
    except Exception as error:  # whatever bytes may cause
        got = f"{path.name}, at {place}: {str(error) or type(error).__name__}"
        raise BadInput("log", "be an undamaged bag of ROS 2", got) from None
    if not rows:
        got = f"{path.name}, which has {', '.join(sorted(unknown)) or 'none'}"
        raise BadInput("log", "have messages of known types", got)
    notes += [f"{one} is left out: its type is unknown" for one in sorted(unknown)]
    first = min(min(several) for several in stamps.values())
    tables = {topic: _table(np.array(stamps[topic]) - first, rows[topic], kinds[topic]) for topic in rows}
    return Recording(tables, path.name, "ROS 2 bag", tuple(notes))


def _table(nanoseconds: np.ndarray, rows: list[dict[str, float]], kind: str) -> Table:
    names = dict.fromkeys(name for row in rows for name in row)
    fields = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    return Table(nanoseconds * 1e-9, fields, kind)


def _stamp(message: Any) -> int:
    """Time of the header in ns; 0 without one."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _leaves(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if not name.startswith("__"):
                yield from _leaves(getattr(value, name), f"{path}.{name}".lstrip("."))
    elif isinstance(value, np.ndarray | list):
        for i, one in enumerate(value[:_LONGEST]):
            yield from _leaves(one, f"{path}[{i}]")
    elif isinstance(value, bool | int | float | np.number):
        yield path, float(value)
