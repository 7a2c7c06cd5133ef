"""A scenario with other values at some key paths. The controller knows the nominal plant, not that of the trial."""

import copy
from collections.abc import Container, Mapping
from typing import Any

from undertow.scenario.changed_values import put_value
from undertow.scenario.reading import key_path
from undertow.studies.campaign.labels import is_number

# A published parameter set is a set of numbers, too.
_SETS = "parameters"
_MOST = 4  # keys that a sentence names


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
    if len(varied) > _MOST:
        varied = [*varied[: _MOST - 1], f"{len(varied) - _MOST + 1} other numbers"]
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
