"""Read scenario files: YAML 1.2 with line numbers, or the scenario inside a result file."""

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from undertow.core.errors import BadInput, nearest
from undertow.core.user_code import python_says
from undertow.scenario.foreign_code import check_allowed
from undertow.scenario.provenance import checksum

Path_ = tuple[str | int, ...]

_YAML, _RESULT = (".yaml", ".yml"), ".nc"
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


def read(path: Path, what: str = "SCENARIO", allow_code: bool = False) -> Text:
    """A scenario from a .yaml file, or the resolved one from a .nc result file.

    Args:
        path: of the file.
        what: the argument or key that names it, for messages.
        allow_code: whether the Python code that a result file names may run; that of a .yaml file may.

    Raises:
        BadInput: missing, unreadable, malformed or damaged file, or one that names code that may not run.
    """
    if not path.is_file():
        raise no_file(path, what)
    if path.suffix == _RESULT:
        return _from_result(path, what, allow_code)
    if path.suffix not in _YAML:
        hint = f"If it holds YAML, rename it to {path.stem}.yaml"
        raise BadInput(what, "be a .yaml file, or the run.nc of an earlier run", path.name, hint=hint)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise BadInput(what, "be a text file in UTF-8", path.name, hint="Save it with this encoding") from None
    except OSError as error:
        raise BadInput(what, "be a file that can be read", f"{path}: {error.strerror}") from None
    return parse(text, path.name, path.resolve().parent, what)


def no_file(path: Path, what: str, must: str = "be an existing file") -> BadInput:
    """The error for a path that is a folder, or nothing; it names the files that may be meant.

    Args:
        path: that is no file.
        what: the argument or key that names it.
        must: what that must be.
    """
    if path.is_dir():
        inside = sorted(one.name for one in path.iterdir() if one.suffix in (*_YAML, _RESULT))
        more = ", ..." if len(inside) > _LISTED else ""
        hint = f"Name one of the files in it: {', '.join(inside[:_LISTED])}{more}" if inside else ""
        return BadInput(what, must, f"{path}, a folder", hint=hint)
    folder = path.parent
    if not folder.is_dir():
        return BadInput(what, must, str(path), hint=f"The folder {folder} does not exist")
    files = [one for one in folder.iterdir() if one.suffix in (*_YAML, _RESULT)]
    known = [one.name for one in files if nearest(path.stem, [one.stem])]  # not alike by their ending alone
    return BadInput(what, must, str(path), hint=nearest(path.name, known))


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
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            attributes, actual = dict(dataset.attrs), checksum(dataset)
    except Exception as error:  # whatever netCDF and xarray say of a file that is torn, or no such file
        raise BadInput(what, "be a result file of undertow", f"{path.name}: {python_says(error)}") from None
    text = attributes.get("scenario")
    if not isinstance(text, str):
        raise BadInput(what, "be a result file of undertow", f"{path.name}, which holds no scenario")
    if attributes.get("checksum", actual) != actual:
        hint = "Take its scenario.yaml instead, if that can be trusted"
        got = f"{path.name}, which was changed or damaged since: its checksum does not hold"
        raise BadInput(what, "be as it was written", got, hint=hint)
    found = parse(text, path.name, path.resolve().parent, what)
    check_allowed(found.data, path, attributes.get("code"), what, allow_code)
    return found


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
    from undertow.scenario.yaml_text import load  # what it imports adds filters of warnings to the process

    data, lines = load(text, name, what)
    if not isinstance(data, dict):
        got = "empty" if data is None else "a list" if isinstance(data, list) else f"a single {type(data).__name__}"
        file = "campaign" if what == "CAMPAIGN" else "scenario"
        hint = f"Write `key: value` lines; `undertow describe {file}` shows the keys"
        raise BadInput(what, "be a mapping of keys to values", got, where=name, hint=hint)
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
