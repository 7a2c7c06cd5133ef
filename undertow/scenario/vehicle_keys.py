"""Where the parameters of a vehicle file stand in a scenario that uses it."""

from collections.abc import Iterable, Mapping
from typing import Any

from undertow.core.errors import BadInput
from undertow.scenario.reading import Text
from undertow.scenario.vehicle_parameters import ADJUSTED_OPTIONS, is_outside

_VEHICLE, _THRUSTER = "plant.vehicle", "plant.thruster"
_DELAY = "command_delay"  # no plant has one


def vehicle_keys(names: Iterable[str], scenario: Text) -> dict[str, str]:
    """Key path of each parameter that a plant has, by name.

    Raises:
        BadInput: the scenario has no place for a gain or the lag of its thrusters.
    """
    return {name: _key(name, scenario) for name in names if name != _DELAY}


def _key(name: str, scenario: Text) -> str:
    if not is_outside(name):
        return f"{_VEHICLE}.values.{name}"
    outer: Any = scenario.data.get("plant", {}).get("thruster")
    if not isinstance(outer, Mapping) or outer.get("kind") != "adjusted":
        hint = f"Write `thruster: {{kind: adjusted, thruster: ..., {ADJUSTED_OPTIONS.get(name, 'gain')}: ...}}` there"
        must = f"be `adjusted`, because the vehicle file has a deviation of `{name}`"
        raise BadInput(_THRUSTER, must, hint=hint, where=scenario.location(_THRUSTER))
    if name in ADJUSTED_OPTIONS:
        return f"{_THRUSTER}.{ADJUSTED_OPTIONS[name]}"
    inner = outer.get("thruster")
    is_nested = isinstance(inner, Mapping) and inner.get("kind") == "adjusted"
    number = int(name.partition(".T")[2])
    return f"{_THRUSTER}{'.thruster' if is_nested else ''}.gain[{number - 1}]"
