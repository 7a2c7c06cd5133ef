"""Python code that a scenario names: its owner, and whether the code named by a result file may run.

A scenario file that the user names may run the code that it names, as a script would. A result file may come from
somebody else, and opening it must not run code unasked.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from undertow.core.errors import BadInput
from undertow.scenario.provenance import file_hash

_MARK = ".py:"  # as in ./my_rov.py:my_rov, see `undertow.core.catalogue`


def check_allowed(data: Mapping[str, Any], result: Path, recorded: str | None, what: str, allowed: bool) -> None:
    """Check that the code named by the scenario of a result may run.

    Args:
        data: the scenario.
        result: the result file.
        recorded: hashes of the code of that run, as `code_hashes` gave them.
        what: the argument or key that names the result, for messages.
        allowed: whether the user allowed it.

    Raises:
        BadInput: there is such code, and the user has not allowed it.
    """
    code_names = dict(_named(data))
    if allowed or not code_names:
        return
    changed_files = changed(recorded, data, result.parent)
    files = [_described(key, name, result.parent, changed_files) for key, name in code_names.items()]
    hint = f"{'. '.join(files)}. Read it; to run it, add --allow-code (in Python: allow_code=True)"
    raise BadInput(what, "not name Python code", f"{result}, a file of {_owner(result)}", hint=hint)


def code_hashes(data: Mapping[str, Any], folder: Path) -> str:
    """SHA-256 of every code file that a scenario names, by path, as JSON; without the files that these import.

    Args:
        data: the scenario.
        folder: folder of relative paths.
    """
    files = sorted({_file(name, folder) for _, name in _named(data)})
    return json.dumps({str(path): file_hash(path) for path in files})


def changed(recorded: str | None, data: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Code files that have changed since the run; empty where that is unknown.

    Args:
        recorded: result of `code_hashes` at the time of the run.
        data: the scenario.
        folder: folder of relative paths.
    """
    before, now = json.loads(recorded or "{}"), json.loads(code_hashes(data, folder))
    return tuple(Path(path) for path in now if path in before and before[path] != now[path])


def _described(key: str, name: str, folder: Path, changed_files: tuple[Path, ...]) -> str:
    path = _file(name, folder)
    if not path.exists():
        return f"`{key}` names {name}, a file that does not exist"
    since = ", changed since that run" if path in changed_files else ""
    return f"`{key}` names {path}:{name.rpartition(':')[2]}, a file of {_owner(path)}{since}"


def _file(name: str, folder: Path) -> Path:
    return (folder / name.rpartition(":")[0]).resolve()


def _owner(path: Path) -> str:
    try:
        return path.owner()
    except (KeyError, OSError):  # of a user that this machine does not know
        return "an unknown user"


def _named(node: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Key path and text of every value that names code."""
    if isinstance(node, str) and _MARK in node and path != "description":
        yield path, node
    elif isinstance(node, Mapping):
        for key, value in node.items():
            yield from _named(value, f"{path}.{key}".lstrip("."))
    elif isinstance(node, list | tuple):
        for number, value in enumerate(node):
            yield from _named(value, f"{path}[{number}]")
