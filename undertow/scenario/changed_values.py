"""Other values at key paths of a scenario, which is plain data."""

import itertools
from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any

from undertow.core.errors import BadInput, nearest
from undertow.scenario.reading import key_path
from undertow.scenario.schema import Scenario

_SCALED = ("linear_damping", "quadratic_damping")  # of a vehicle, which one seldom varies entry by entry


def put_value(data: dict[str, Any], key: str, put: Any) -> None:
    """Set the value at a key path; a part given by its name alone becomes a mapping.

    Raises:
        BadInput: the key path leads to nothing of the scenario.
    """
    path = key_path(key)
    node: Any = data
    for step, following in itertools.pairwise(path):
        inner = _entry(node, step, key)
        if isinstance(inner, str):
            inner = {"kind": inner}
        elif inner is None and isinstance(following, int):
            elsewhere = _elsewhere(str(step), data) if node is data else ""
            hint = nearest(str(step), node) or elsewhere or f"Give `{step}` there, with all its entries"
            if step in _SCALED:
                hint += ", or vary all of it by one factor with the disturbance `parameter_error`"
            raise BadInput(key, f"name an entry of a list of the scenario, which has no `{step}` there", hint=hint)
        elif inner is None:
            inner = {}
        node[step] = inner
        node = inner
    _entry(node, path[-1], key)
    node[path[-1]] = put


def _elsewhere(word: str, data: dict[str, Any]) -> str:
    """Sentence that names the list whose key is nearest to a word that is no key at the top of a scenario."""
    if word in Scenario.model_fields:
        return ""
    paths = {path.rpartition(".")[2]: path for path in _lists(data, "")}
    matches = get_close_matches(word, list(paths), n=1)
    return f"Did you mean `{paths[matches[0]]}`?" if matches else ""


def _lists(node: Any, path: str) -> Iterator[str]:
    """Key paths of all lists below a node."""
    pairs = node.items() if isinstance(node, dict) else ()
    if isinstance(node, list):
        pairs = ((i, child) for i, child in enumerate(node) if isinstance(child, dict))
    for step, child in pairs:
        inner = f"{path}[{step}]" if isinstance(step, int) else f"{path}.{step}".lstrip(".")
        if isinstance(child, list):
            yield inner
        yield from _lists(child, inner)


def _entry(node: Any, step: str | int, key: str) -> Any:
    if isinstance(node, list):
        if isinstance(step, int) and 0 <= step < len(node):
            return node[step]
        raise BadInput(key, f"name one of the {len(node)} entries, 0 to {len(node) - 1}", f"[{step}]")
    if not isinstance(node, dict):
        raise BadInput(key, "lead to a key of the scenario", f"past {node!r}")
    if isinstance(step, int):
        raise BadInput(key, "name an entry of a list only where there is a list", f"[{step}] of {', '.join(node)}")
    return node.get(step)
