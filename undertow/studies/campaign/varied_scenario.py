"""A scenario with other values at some key paths. The controller knows the nominal plant, not that of the trial."""

import copy
import itertools
from collections.abc import Container, Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from undertow.core.errors import BadInput, nearest
from undertow.scenario.reading import key_path
from undertow.scenario.schema import Scenario
from undertow.studies.campaign.labels import is_number

# A published parameter set is a set of numbers, too.
_SETS = "parameters"


def varied_scenario(
    data: Mapping[str, Any], values: Mapping[str, Any], known_keys: Container[str] = ()
) -> dict[str, Any]:
    """A scenario with other values, whose nominal model keeps the numbers that the plant had.

    Another part, such as another vehicle, is known to the controller. With `model: {follow: true}`, or a `model.plant`
    of the scenario, nothing is added.

    Args:
        data: the scenario.
        values: by key path.
        known_keys: key paths whose values the controller knows in any case.

    Raises:
        BadInput: a key path leads to nothing of the scenario.
    """
    varied = copy.deepcopy(dict(data))
    for key, value in values.items():
        put_value(varied, key, copy.deepcopy(value))
    model = varied.get("model") or {}
    unknown = _unknown(values, known_keys)
    if not isinstance(model, dict) or model.get("follow") or "plant" in model or not unknown:
        return varied
    nominal = {"plant": copy.deepcopy(data.get("plant", {}))}
    for key, value in values.items():
        if key_path(key)[0] == "plant" and key not in unknown:
            put_value(nominal, key, copy.deepcopy(value))
    return varied | {"model": {**model, "plant": nominal["plant"]}}


def nominal_model_sentence(data: Mapping[str, Any], values: Mapping[str, Any], known_keys: Container[str] = ()) -> str:
    """Sentence on what the controller knows of the numbers of the plant that vary; empty where none do."""
    varied = [f"`{key}`" for key in _unknown(values, known_keys)]
    if not varied:
        return ""
    keys = " and ".join(filter(None, (", ".join(varied[:-1]), varied[-1])))
    if (data.get("model") or {}).get("follow"):
        return f"The controller knows the plant of each trial: its nominal model follows {keys}."
    verb = "varies" if len(varied) == 1 else "vary"
    return f"The controller knows the nominal plant of the scenario: {keys} {verb} in the simulated plant alone."


def _unknown(values: Mapping[str, Any], known_keys: Container[str]) -> list[str]:
    """Key paths of values that a controller does not know: numbers and published parameter sets of the plant."""
    return [key for key, value in values.items() if key not in known_keys and _is_number_of_plant(key, value)]


def _is_number_of_plant(key: str, value: Any) -> bool:
    section, *path = key_path(key)
    numbers = value if isinstance(value, list) else [value]
    return section == "plant" and bool(path) and (path[-1] == _SETS or all(map(is_number, numbers)))


def put_value(data: dict[str, Any], key: str, put: Any) -> None:
    """Set the value at a key path; a part given by its name alone becomes a mapping."""
    path = key_path(key)
    node: Any = data
    for step, following in itertools.pairwise(path):
        inner = _entry(node, step, key)
        if isinstance(inner, str):
            inner = {"kind": inner}
        elif inner is None and isinstance(following, int):
            elsewhere = _elsewhere(str(step), data) if node is data else ""
            hint = nearest(str(step), node) or elsewhere or f"Give `{step}` there, with all its entries"
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
