"""What a file holds, as it stands there: tables of named columns, before frames and units are known."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput, did_you_mean


class TopicMessages(NamedTuple):
    """Messages of one topic.

    Attributes:
        time: s, shape (rows,).
        fields: columns by name, shape (rows,).
        kind: type of the messages, by which a mapping may name them too.
        texts: the first cell, and where it stands, of the columns that hold text and are therefore no fields.
    """

    time: np.ndarray
    fields: Mapping[str, np.ndarray]
    kind: str = ""
    texts: Mapping[str, str] = MappingProxyType({})


class Recording(NamedTuple):
    """What a file holds.

    Attributes:
        tables: by topic; "" names that of a file that has only one.
        source: name of the file.
        format: as in `Log`.
        notes: as in `Log`.
        parameters: of the autopilot, by name, where the file has them; the last value of each.
        left_out: reason why a topic of the file is no table, by name.
    """

    tables: Mapping[str, TopicMessages]
    source: str
    format: str
    notes: tuple[str, ...] = ()
    parameters: Mapping[str, float] = MappingProxyType({})
    left_out: Mapping[str, str] = MappingProxyType({})

    def find(self, topic: str) -> tuple[str, TopicMessages] | None:
        """The table of a topic, or the first whose messages are of a type; None without one."""
        if topic in self.tables:
            return topic, self.tables[topic]
        of_this_type = [(name, table) for name, table in self.tables.items() if table.kind == topic]
        return of_this_type[0] if of_this_type else None

    def table(self, topic: str) -> tuple[str, TopicMessages]:
        """As `find`; the only table where no topic is named.

        Raises:
            BadInput: there is no such topic.
        """
        if not topic and len(self.tables) == 1:
            return next(iter(self.tables.items()))
        topic_and_table = self.find(topic)
        if topic_and_table is None and topic in self.left_out:
            raise BadInput(
                "topic", "name messages that can be read", f"{topic} of {self.source}: {self.left_out[topic]}"
            )
        if topic_and_table is None:
            got = f"not in {self.source}"
            raise BadInput(
                "topic",
                f"name one of the {len(self.tables)} topics of the log",
                f"{topic or 'left out'}, {got}",
                hint=did_you_mean(topic, self.tables) if self.tables else "",
            )
        return topic_and_table


class _Rows(Mapping[str, np.ndarray]):
    """Some rows of the columns of a table, taken when a column is asked for."""

    def __init__(self, fields: Mapping[str, np.ndarray], rows: np.ndarray):
        self._fields, self._rows = fields, rows

    def __getitem__(self, name: str) -> np.ndarray:
        return self._fields[name][self._rows]

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __contains__(self, name: object) -> bool:
        return name in self._fields

    def __len__(self) -> int:
        return len(self._fields)


def cleaned(table: TopicMessages) -> tuple[TopicMessages, int]:
    """The table without samples of the same time as the one before, and how many these were."""
    repeated = np.concatenate([[False], np.diff(table.time) == 0])
    if not repeated.any():
        return table, 0
    return rows_of(table, ~repeated), int(repeated.sum())


def rows_of(table: TopicMessages, rows: np.ndarray) -> TopicMessages:
    """The table of some rows, by their numbers or by whether each is taken."""
    return table._replace(time=table.time[rows], fields=_Rows(table.fields, rows))
