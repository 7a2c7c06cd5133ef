"""Columns of the messages of a topic, which need not all have the same fields.

Numbers are kept as they come, and become a column when one is asked for: memory and time are those of the numbers that
the messages have, however many different fields these are.
"""

from array import array
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from undertow.logs.recording import TopicMessages

MOST_FIELDS = 2**16 - 1  # of a topic; a file could name another one in each message


class SparseColumns(Mapping[str, np.ndarray]):
    """Columns by name, NaN where a message lacks the field.

    Args:
        rows: number of messages.
        numbers: message, counted from 0, and value of each number of a column.
        order: of the messages, shape (rows,).
    """

    def __init__(self, rows: int, numbers: Mapping[str, tuple[array, array]], order: np.ndarray):
        self._rows, self._numbers, self._order = rows, numbers, order

    def __getitem__(self, name: str) -> np.ndarray:
        messages, values = self._numbers[name]
        column = np.full(self._rows, np.nan)
        column[np.frombuffer(messages, dtype=np.int64)] = np.frombuffer(values, dtype=float)
        return column[self._order]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __contains__(self, name: object) -> bool:
        return name in self._numbers  # without making the column

    def __len__(self) -> int:
        return len(self._numbers)


class MessageFields:
    """Numbers of the messages of a topic, one message after the other.

    Args:
        kind: type of the messages.

    Attributes:
        kind: as above.
        stamps: time of each message, ns.
    """

    def __init__(self, kind: str):
        self.kind = kind
        self.stamps = array("q")
        self._recorded = array("q")
        self._numbers: dict[str, tuple[array, array]] = {}

    def add(self, stamp: int, recorded: int, fields: Iterable[tuple[str, float]]) -> None:
        """Add a message: its time and that of its recording, ns, and its numbers by name.

        Raises:
            ValueError: the messages have too many different fields.
        """
        row = len(self.stamps)
        for name, value in fields:
            if name not in self._numbers:
                if len(self._numbers) == MOST_FIELDS:
                    raise ValueError(f"its messages have more than {MOST_FIELDS} different fields")
                self._numbers[name] = array("q"), array("d")
            messages, values = self._numbers[name]
            messages.append(row)
            values.append(value)
        self.stamps.append(stamp)
        self._recorded.append(recorded)

    def table(self, start: int = 0) -> TopicMessages:
        """The table of the messages in the order in which they were recorded, with times since the start, ns."""
        order = np.argsort(np.frombuffer(self._recorded, dtype=np.int64), kind="stable")
        stamps = np.frombuffer(self.stamps, dtype=np.int64)[order]
        return TopicMessages((stamps - start) * 1e-9, SparseColumns(len(order), self._numbers, order), self.kind)
