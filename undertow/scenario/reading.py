"""Read scenario files: YAML 1.2 with line numbers, or the scenario inside a result file."""

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput, nearest
from undertow.logs.result_file import UnreadableResult, opened_result
from undertow.scenario.foreign_code import check_allowed
from undertow.scenario.provenance import checksum
from undertow.scenario.yaml_text import load

Path_ = tuple[str | int, ...]

_YAML, _RESULT = (".yaml", ".yml"), ".nc"
_LOGS = (".mcap", ".csv", ".bin", ".tlog", ".ulg", ".bag", ".db3")
_LISTED = 6  # files of a folder that a message names


class Text(NamedTuple):
    """A scenario as read: plain data, and the line of each key."""

    data: dict[str, Any]
    name: str  # file name for messages; "" when not from a file
    folder: Path  # relative paths start here
    lines: dict[Path_, int]  # key path -> line, from 1

    def where(self, path: Path_) -> str:
        """Location of a key, or of the nearest enclosing one, for messages."""
        while path and path not in self.lines:
            path = path[:-1]
        if not self.name:
            return ""
        return f"{self.name}, line {self.lines[path]}" if path in self.lines else self.name

    def as_written(self, name: str) -> str:
        """A key path as the user wrote it: `plant.vehicle` for the `kind` of `vehicle: my_rov.yaml`."""
        section, _, last = name.rpartition(".")
        value: Any = self.data
        for step in key_path(section):
            try:
                value = value[step]
            except (KeyError, IndexError, TypeError):  # a default that is not written
                return name
        return section if last == "kind" and isinstance(value, str) else name

    def location(self, name: str) -> str:
        """Location of a key by its path in words, such as `thrusters[2].position`."""
        return self.where(key_path(name))


def from_data(data: Mapping[str, Any]) -> Text:
    """A scenario given as Python data."""
    return Text(_plain(data), "", Path(), {})


def key_path(name: str) -> Path_:
    """`thrusters[2].position` as ("thrusters", 2, "position")."""
    return tuple(int(step) if step.isdigit() else step for step in re.findall(r"[^.\[\]]+", name))


def read(path: Path, what: str = "", allow_code: bool = False, file: str = "scenario") -> Text:
    """A scenario from a .yaml file, or the resolved one from a .nc result file.

    Args:
        path: of the file.
        what: the key or option that names it, for messages; "" for an argument.
        allow_code: whether the Python code that a result file names may run; that of a .yaml file may.
        file: what it should be, for messages: scenario or campaign.

    Raises:
        BadInput: missing, unreadable, malformed or damaged file, or one that names code that may not run.
    """
    if not path.is_file():
        raise no_file(path, what)
    if path.suffix == _RESULT:
        return _from_result(path, what, allow_code)
    if path.suffix not in _YAML:
        raise wrong_file(path, what, "be a .yaml file, or the run.nc of an earlier run", hint=_rename(path))
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise wrong_file(path, what, "be a text file in UTF-8", hint="Save it with this encoding") from None
    except OSError as error:
        raise BadInput(what or str(path), "be a file that can be read", f"{path}: {error.strerror}") from None
    return parse(text, path.name, path.resolve().parent, what, file)


def wrong_file(path: Path, what: str, must: str, got: str = "", hint: str = "", where: str = "") -> BadInput:
    """Error for a file, which is named once.

    Args:
        path: of the file.
        what: the key or option that names it; "" for an argument.
        must: what it must be.
        got: what it is; "" where that goes without saying.
        hint: the remedy.
        where: file and line of the key, when known.
    """
    if what:
        return BadInput(what, must, f"{path}, {got}" if got else str(path), hint=hint, where=where)
    return BadInput(str(path), must, got or None, hint=hint, where=where)


def no_file(path: Path, what: str, must: str = "be an existing file") -> BadInput:
    """The error for a path that is a folder, a file of another kind, or nothing; it names the files that may be meant.

    Args:
        path: that cannot be read.
        what: the key or option that names it; "" for an argument.
        must: what that must be.
    """
    if path.is_dir():
        hint = f"Name one of the files in it: {listed}" if (listed := _listed(_files_in(path))) else ""
        return wrong_file(path, what, must, "a folder", hint=hint)
    if path.is_file() or ".py:" in path.name:
        return wrong_file(path, what, must, hint=_rename(path))
    folder = path.parent
    if not folder.is_dir():
        return wrong_file(path, what, must, hint=f"The folder {folder} does not exist")
    files = _files_in(folder)
    listing = ""
    if not what:
        listing = f"Files there: {_listed(files)}" if files else "`undertow init` writes a scenario to start from"
    return wrong_file(path, what, must, "" if what else "not", hint=nearest_file(path) or listing)


def nearest_file(path: Path) -> str:
    """Sentence that names the YAML or result file beside a path that may be meant by it; "" where there is none."""
    candidates = [
        name for name in _files_in(path.parent) if nearest(path.stem, [Path(name).stem])
    ]  # not by its ending alone
    return nearest(path.name, candidates)


def _files_in(folder: Path) -> list[str]:
    """Names of the YAML and result files in a folder."""
    return sorted(file.name for file in folder.iterdir() if file.suffix in (*_YAML, _RESULT)) if folder.is_dir() else []


def _listed(files: Sequence[str]) -> str:
    return ", ".join(files[:_LISTED]) + (", ..." if len(files) > _LISTED else "")


def _rename(path: Path) -> str:
    """Remedy for a file with another ending."""
    if ".py" in path.name:
        return "Python code is named in a scenario, such as `controller: ./file.py:function`"
    if path.suffix.lower() in _LOGS:
        return f"A log is shown by `undertow logs {path}`, and scored by `undertow logs score SCENARIO {path}`"
    return f"If it holds YAML, rename it to {path.stem}.yaml"


def dump(data: Mapping[str, Any]) -> str:
    """Data as YAML text that reads back to the same data."""
    from ruamel.yaml import YAML

    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 4096
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.dump(dict(data), stream)
    return stream.getvalue()


def _from_result(path: Path, what: str, allow_code: bool) -> Text:
    must = "be a result file of undertow"
    try:
        with opened_result(path) as dataset:
            attributes, actual = dict(dataset.attrs), checksum(dataset)
    except UnreadableResult as error:
        raise wrong_file(path, what, must, str(error), hint="Run its scenario again") from None
    text = attributes.get("scenario")
    if not isinstance(text, str):
        raise wrong_file(path, what, must, "one that holds no scenario")
    if attributes.get("checksum", actual) != actual:
        hint = "Take its scenario.yaml instead, if that can be trusted"
        got = "changed or damaged since: its checksum does not hold"
        raise wrong_file(path, what, "be as it was written", got, hint=hint)
    scenario = parse(text, path.name, path.resolve().parent, what)
    check_allowed(scenario.data, path, attributes.get("code"), what or str(path), allow_code)
    return scenario


def parse(text: str, name: str, folder: Path, what: str = "", file: str = "scenario") -> Text:
    """YAML text as plain data with the line of every key.

    Args:
        text: YAML.
        name: of its file, for messages.
        folder: where relative paths in it start.
        what: the key or option that names it, for messages; "" for an argument.
        file: what it should be, for messages: scenario or campaign.

    Raises:
        BadInput: malformed.
    """
    what = what or name or file
    data, lines = load(text, name, what)
    if not isinstance(data, dict):
        got = "empty" if data is None else "a list" if isinstance(data, list) else f"a single {type(data).__name__}"
        hint = f"Write `key: value` lines; `undertow describe {file}` shows the keys"
        raise BadInput(what, "be a mapping of keys to values", got, where="" if what == name else name, hint=hint)
    return Text(data, name, folder, lines)


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
