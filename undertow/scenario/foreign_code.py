"""Python code that a scenario names: whose it is, and whether what a result names may run.

A scenario file that the user names may run the code that it names, as a script would. A result file was perhaps made by
somebody else, and opening it is not asking for code to be run.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from undertow.core.errors import BadInput
from undertow.scenario.provenance import file_hash

_MARK = ".py:"  # as in ./my_rov.py:my_rov, see `undertow.core.catalogue`


def check_allowed(data: Mapping[str, Any], result: Path, recorded: str | None, what: str, allowed: bool) -> None:
    """That the code that the scenario of a result names may run.

    Args:
        data: the scenario.
        result: the file that it stands in.
        recorded: hashes of the code of that run, as `code_hashes` gave them.
        what: the argument or key that names the result, for messages.
        allowed: whether the user said so.

    Raises:
        BadInput: there is such code, and nobody said so.
    """
    named = dict(_named(data))
    if allowed or not named:
        return
    known = changed(recorded, data, result.parent)
    said = [_said(key, name, result.parent, known) for key, name in named.items()]
    hint = f"{'. '.join(said)}. Read it; to run it, add --allow-code (in Python: allow_code=True)"
    raise BadInput(what, "be without Python code of its own", f"{result}, a file of {_owner(result)}", hint=hint)


def code_hashes(data: Mapping[str, Any], folder: Path) -> str:
    """SHA-256 of every file of code that a scenario names, by path, as JSON; what those files import is not among them.

    Args:
        data: the scenario.
        folder: where relative paths start.
    """
    files = sorted({_file(name, folder) for _, name in _named(data)})
    return json.dumps({str(path): file_hash(path) for path in files})


def changed(recorded: str | None, data: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Files of code that have other contents than those that ran; none where that is not known.

    Args:
        recorded: what `code_hashes` gave then.
        data: the scenario.
        folder: where relative paths start.
    """
    before, now = json.loads(recorded or "{}"), json.loads(code_hashes(data, folder))
    return tuple(Path(path) for path in now if path in before and before[path] != now[path])


def _said(key: str, name: str, folder: Path, known: tuple[Path, ...]) -> str:
    path = _file(name, folder)
    if not path.exists():
        return f"`{key}` names {name}, a file that does not exist"
    since = ", changed since that run" if path in known else ""
    return f"`{key}` names {path}:{name.rpartition(':')[2]}, a file of {_owner(path)}{since}"


def _file(name: str, folder: Path) -> Path:
    return (folder / name.rpartition(":")[0]).resolve()


def _owner(path: Path) -> str:
    try:
        return path.owner()
    except (KeyError, OSError):  # of a user that this machine does not know
        return "an unknown user"


def _named(node: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Key path and text of everything that could name code."""
    if isinstance(node, str) and _MARK in node and path != "description":
        yield path, node
    elif isinstance(node, Mapping):
        for key, value in node.items():
            yield from _named(value, f"{path}.{key}".lstrip("."))
    elif isinstance(node, list | tuple):
        for number, value in enumerate(node):
            yield from _named(value, f"{path}[{number}]")
