"""Reading scenario files: YAML 1.2 with line numbers, or the scenario inside a result file."""

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from undertow.core.errors import BadInput

Path_ = tuple[str | int, ...]

# Aliases let a few lines of YAML stand for very many; no scenario comes near these.
_MOST_KEYS = 100_000
_DEEPEST = 20


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


def key_path(name: str) -> Path_:
    """`thrusters[2].position` as ("thrusters", 2, "position")."""
    return tuple(int(step) if step.isdigit() else step for step in re.findall(r"[^.\[\]]+", name))


def read(path: Path, what: str = "SCENARIO") -> Text:
    """A scenario from a .yaml file, or the resolved one from a .nc result file.

    Args:
        path: of the file.
        what: the argument or key that names it, for messages.

    Raises:
        BadInput: missing, unreadable or malformed file.
    """
    if not path.is_file():
        raise BadInput(what, "be an existing file", str(path))
    if path.suffix == ".nc":
        return _from_result(path, what)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise BadInput(what, "be a text file", path.name) from None
    except OSError as error:
        raise BadInput(what, "be a file that can be read", f"{path}: {error.strerror}") from None
    return parse(text, path.name, path.resolve().parent, what)


def dump(data: Mapping[str, Any]) -> str:
    """Data as YAML text that reads back to the same data."""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 4096
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.dump(dict(data), stream)
    return stream.getvalue()


def _from_result(path: Path, what: str) -> Text:
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            text = dataset.attrs.get("scenario")
    except (OSError, ValueError) as error:
        raise BadInput(what, "be a result file of undertow", f"{path.name}: {error}") from None
    if text is None:
        raise BadInput(what, "be a result file of undertow", f"{path.name}, which holds no scenario")
    return parse(text, path.name, path.resolve().parent, what)


def parse(text: str, name: str, folder: Path, what: str) -> Text:
    """YAML text as plain data with the line of every key.

    Args:
        text: YAML.
        name: of its file, for messages.
        folder: where relative paths in it start.
        what: the argument or key that names it, for messages.

    Raises:
        BadInput: malformed.
    """
    try:
        tree = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}, line {mark.line + 1}" if mark else name
        problem = " ".join((error.problem or "malformed").split())
        raise BadInput(what, "be valid YAML", f"not: {problem}", where=where) from None
    except (YAMLError, ValueError) as error:
        raise BadInput(what, "be valid YAML", f"not: {error}", where=name) from None
    except RecursionError:
        raise BadInput(what, "be less deeply nested", where=name) from None
    if not isinstance(tree, Mapping):
        got = "empty" if tree is None else "a list" if isinstance(tree, list) else f"a single {type(tree).__name__}"
        raise BadInput(what, "be a mapping of keys to values", got, where=name)
    lines: dict[Path_, int] = {}
    return Text(_unwrapped(tree, (), lines, name, what), name, folder, lines)


def _unwrapped(node: Any, path: Path_, lines: dict[Path_, int], name: str, what: str) -> Any:
    """Same data without the reader's own classes; notes the line of every key and entry."""
    if len(path) > _DEEPEST or len(lines) > _MOST_KEYS:
        raise BadInput(what, f"have at most {_MOST_KEYS} keys and {_DEEPEST} levels", "larger", where=name)
    if not isinstance(node, Mapping | list):
        return _plain(node)
    items = node.items() if isinstance(node, Mapping) else enumerate(node)
    unwrapped = {}
    for key, value in items:
        label = key if isinstance(key, int) and isinstance(node, list) else str(key)
        place = (node.lc.data or {}).get(key)  # pyright: ignore[reportAttributeAccessIssue]  (none where merged in)
        if place is not None:
            lines[(*path, label)] = place[0] + 1
        unwrapped[label] = _unwrapped(value, (*path, label), lines, name, what)
    return unwrapped if isinstance(node, Mapping) else list(unwrapped.values())


def _plain(node: Any) -> Any:
    """Same data without classes of other libraries."""
    if isinstance(node, Mapping):
        return {str(key): _plain(value) for key, value in node.items()}
    if isinstance(node, Sequence) and not isinstance(node, str):
        return [_plain(value) for value in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
