"""YAML 1.2 as plain data: mappings with text keys, lists, text, numbers. No tags, and a bounded size.

The text is composed from the parser's events, so that a file that is too large is rejected while it is read: with
aliases, a few lines can stand for billions of entries.
"""

import functools
from collections.abc import Iterator
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.nodes import ScalarNode

from undertow.core.errors import BadInput
from undertow.scenario.yaml_mistakes import mistake_of

Path_ = tuple[str | int, ...]

_MOST, _DEEPEST = 50_000, 20
_REMEMBERED = 8  # texts
_BITS = 1024  # of an integer: larger ones are no floating-point numbers either

_PREFIX = "tag:yaml.org,2002:"
_MERGE = f"{_PREFIX}merge"


class Malformed(Exception):
    """Text that is not valid YAML, or not supported; with the parts of the error and its line, from 1."""

    def __init__(self, must: str, got: str, line: int | None, hint: str = ""):
        self.must, self.got, self.line, self.hint = must, got, line, hint
        super().__init__(must)


class _Node(NamedTuple):
    """A value with the lines of its keys or entries, its number of entries, and its depth."""

    value: Any  # a scalar, or nodes by key, or a list of nodes
    lines: dict[str | int, int]
    size: int
    depth: int


def load(text: str, name: str, what: str) -> tuple[Any, dict[Path_, int]]:
    """The only document of a text as plain data, and the line of every key and entry.

    Args:
        text: YAML.
        name: of its file, for messages.
        what: the argument or key that names it, for messages.

    Raises:
        BadInput: malformed, tagged, or too large.
    """
    try:
        tree = _tree(text)
    except Malformed as error:
        where = f"{name}, line {error.line}" if error.line and name else name
        raise BadInput(what, error.must, error.got, where=where, hint=error.hint) from None
    lines: dict[Path_, int] = {}
    return _plain(tree, (), lines), lines


@functools.lru_cache(_REMEMBERED)
def _tree(text: str) -> _Node:
    """The document of a text, composed once: the trials of a campaign read the same vehicle file."""
    return _Composer(text).document()


def _plain(node: _Node, path: Path_, lines: dict[Path_, int]) -> Any:
    """Same data, each alias a copy of its own."""
    if not isinstance(node.value, dict | list):
        return node.value
    items = node.value.items() if isinstance(node.value, dict) else enumerate(node.value)
    lines |= {(*path, key): line for key, line in node.lines.items()}
    plain = {key: _plain(value, (*path, key), lines) for key, value in items}
    return plain if isinstance(node.value, dict) else list(plain.values())


class _Composer:
    """From events to nodes."""

    def __init__(self, text: str):
        self._yaml = YAML(typ="safe", pure=True)
        self._events = self._parsed(text)
        self._anchors: dict[str, _Node] = {}
        self._count = 0

    def document(self) -> _Node:
        """The first document, which must be the only one."""
        empty, documents = _Node(None, {}, 1, 0), []
        for event in self._events:
            if isinstance(event, DocumentStartEvent):
                if documents:
                    raise Malformed("be one YAML document", "several", event.start_mark.line + 1)
                documents.append(self._node(next(self._events), 0))
        return documents[0] if documents else empty

    def _parsed(self, text: str) -> Iterator[Any]:
        try:
            yield from self._yaml.parse(text)
        except MarkedYAMLError as error:
            raise _invalid(*mistake_of(error, text)) from None
        except (YAMLError, ValueError) as error:
            raise _invalid(str(error), None) from None

    def _node(self, event: Any, depth: int) -> _Node:
        line = event.start_mark.line + 1
        if isinstance(event, AliasEvent):
            if event.anchor not in self._anchors:
                raise _invalid(f"found undefined alias {event.anchor!r}", line)
            anchored = self._anchors[event.anchor]
            self._counted(anchored.size, depth + anchored.depth, line)
            return anchored
        if event.tag is not None and not (isinstance(event, ScalarEvent) and str(event.tag) == "!"):
            raise Malformed("be YAML without tags", f"tagged {event.tag}", line, "Leave the tag out")
        self._counted(1, depth, line)
        node = self._scalar(event) if isinstance(event, ScalarEvent) else self._collection(event, depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _counted(self, size: int, depth: int, line: int) -> None:
        self._count += size
        if depth > _DEEPEST:
            raise Malformed(f"have at most {_DEEPEST} levels", "more deeply nested", line)
        if self._count > _MOST:
            hint = "Put tables into CSV files, which parts take as `file`"
            raise Malformed(f"have at most {_MOST} entries", "larger", line, hint)

    def _collection(self, event: Any, depth: int) -> _Node:
        if isinstance(event, MappingStartEvent):
            value, lines = self._mapping(depth)
        else:
            assert isinstance(event, SequenceStartEvent)
            value, lines = self._sequence(depth)
        nodes = list(value.values()) if isinstance(value, dict) else value
        return _Node(value, lines, 1 + sum(n.size for n in nodes), 1 + max((n.depth for n in nodes), default=0))

    def _sequence(self, depth: int) -> tuple[list[_Node], dict[str | int, int]]:
        entries: list[_Node] = []
        lines: dict[str | int, int] = {}
        while not isinstance(event := next(self._events), SequenceEndEvent):
            lines[len(entries)] = event.start_mark.line + 1
            entries.append(self._node(event, depth + 1))
        return entries, lines

    def _mapping(self, depth: int) -> tuple[dict[str, _Node], dict[str | int, int]]:
        entries: dict[str, _Node] = {}
        lines: dict[str | int, int] = {}
        merged: dict[str, _Node] = {}
        while not isinstance(event := next(self._events), MappingEndEvent):
            line = event.start_mark.line + 1
            merge = self._resolved(event) == _MERGE
            key = "<<" if merge else self._key(event, depth)
            node = self._node(next(self._events), depth + 1)
            if merge:
                merged = {**_mergeable(node, line), **merged}
                continue
            if key in entries:
                message = f"the key `{key}` is given twice, first in line {lines[key]}"
                raise _invalid(message, line, "Remove one of them")
            entries[key], lines[key] = node, line
        return {**entries, **{key: node for key, node in merged.items() if key not in entries}}, lines

    def _key(self, event: Any, depth: int) -> str:
        node = self._node(event, depth + 1)
        if isinstance(node.value, dict | list):
            raise Malformed("have words for keys", "a list or mapping for a key", event.start_mark.line + 1)
        return str(node.value)

    def _resolved(self, event: Any) -> str:
        """What a scalar looks like: tag:yaml.org,2002:int, ..."""
        if not isinstance(event, ScalarEvent):
            return ""
        return str(self._yaml.resolver.resolve(ScalarNode, event.value, event.implicit))

    def _scalar(self, event: ScalarEvent) -> _Node:
        kind = self._resolved(event).removeprefix(_PREFIX)
        construct = self._yaml.constructor
        makers = {
            "int": construct.construct_yaml_int,
            "float": construct.construct_yaml_float,
            "bool": construct.construct_yaml_bool,
            "null": construct.construct_yaml_null,
        }
        if kind not in makers or (kind in ("int", "float") and "_" in event.value):  # dates, too, are text, and 1_000
            return _Node(event.value, {}, 1, 0)
        try:
            value = makers[kind](ScalarNode(kind, event.value))
        except ValueError as error:  # an integer of thousands of digits
            raise _invalid(str(error), event.start_mark.line + 1) from None
        if kind == "int" and value.bit_length() > _BITS:  # of so many hexadecimal digits that no message could show it
            digits = f"one of {len(event.value)} characters"
            raise Malformed(f"have integers of at most {_BITS} bits", digits, event.start_mark.line + 1)
        return _Node(value, {}, 1, 0)


def _mergeable(node: _Node, line: int) -> dict[str, _Node]:
    """The keys that `<<` merges from a mapping, or from several, of which the first has precedence."""
    mappings = node.value if isinstance(node.value, list) else [node]
    if not all(isinstance(mapping.value, dict) for mapping in mappings):
        raise _invalid("`<<` takes a mapping, or a list of them", line)
    return {key: value for mapping in reversed(mappings) for key, value in mapping.value.items()}


def _invalid(problem: str, line: int | None, hint: str = "") -> Malformed:
    return Malformed("be valid YAML", f"not: {' '.join(problem.split())}", line, hint)
