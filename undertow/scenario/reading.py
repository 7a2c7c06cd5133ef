"""Reading scenario files: YAML 1.2 with line numbers, or the scenario inside a result file."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from undertow.core.errors import BadInput

Path_ = tuple[str | int, ...]


class Text(NamedTuple):
    """A scenario as read: plain data, and where each key stands."""

    data: dict[str, Any]
    name: str  # file name for messages; "" when not from a file
    folder: Path  # relative paths start here
    lines: dict[Path_, int]  # key path -> line, from 1

    def where(self, path: Path_) -> str:
        """Place of a key, or of the nearest enclosing one, for messages."""
        while path and path not in self.lines:
            path = path[:-1]
        if not self.name:
            return ""
        return f"{self.name}, line {self.lines[path]}" if path in self.lines else self.name


def from_data(data: Mapping[str, Any]) -> Text:
    """A scenario given as Python data."""
    return Text(_plain(data), "", Path(), {})


def read(path: Path) -> Text:
    """A scenario from a .yaml file, or the resolved one from a .nc result file.

    Raises:
        BadInput: missing, unreadable or malformed file.
    """
    if not path.is_file():
        raise BadInput("SCENARIO", "be an existing file", str(path))
    if path.suffix == ".nc":
        return _from_result(path)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise BadInput("SCENARIO", "be a text file", path.name) from None
    return _parse(text, path.name, path.resolve().parent)


def dump(data: Mapping[str, Any]) -> str:
    """Data as YAML text that reads back to the same data."""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 4096
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.dump(dict(data), stream)
    return stream.getvalue()


def _from_result(path: Path) -> Text:
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            text = dataset.attrs.get("scenario")
    except (OSError, ValueError) as error:
        raise BadInput("SCENARIO", "be a result file of undertow", f"{path.name}: {error}") from None
    if text is None:
        raise BadInput("SCENARIO", "be a result file of undertow", f"{path.name}, which holds no scenario")
    return _parse(text, path.name, path.resolve().parent)


def _parse(text: str, name: str, folder: Path) -> Text:
    try:
        tree = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}, line {mark.line + 1}" if mark else name
        problem = " ".join((error.problem or "malformed").split())
        raise BadInput("SCENARIO", "be valid YAML", problem.split(" original value")[0], where=where) from None
    except YAMLError as error:
        raise BadInput("SCENARIO", "be valid YAML", str(error), where=name) from None
    if not isinstance(tree, Mapping):
        got = "empty" if tree is None else f"a {type(tree).__name__}"
        raise BadInput("SCENARIO", "be a mapping of keys to values", got, where=name)
    lines: dict[Path_, int] = {}
    _note_lines(tree, (), lines)
    return Text(_plain(tree), name, folder, lines)


def _note_lines(node: Any, path: Path_, lines: dict[Path_, int]) -> None:
    if isinstance(node, Mapping):
        for key, value in node.items():
            lines[(*path, key)] = node.lc.key(key)[0] + 1  # pyright: ignore[reportAttributeAccessIssue]
            _note_lines(value, (*path, key), lines)
    elif isinstance(node, list):
        for index, value in enumerate(node):
            lines[(*path, index)] = node.lc.item(index)[0] + 1  # pyright: ignore[reportAttributeAccessIssue]
            _note_lines(value, (*path, index), lines)


def _plain(node: Any) -> Any:
    """Same data without the reader's own classes."""
    if isinstance(node, Mapping):
        return {str(key): _plain(value) for key, value in node.items()}
    if isinstance(node, Sequence) and not isinstance(node, str):
        return [_plain(value) for value in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
