"""Published parameter sets of the vehicle of a scenario, and its plant with another one of them."""

import inspect
import sys
from typing import Any

from undertow.core import catalogue
from undertow.core.contracts import AbstractPlant
from undertow.scenario import factory
from undertow.scenario.build import Built


def parameter_sets(built: Built) -> tuple[str, ...]:
    """Published parameter sets of the scenario's vehicle, its own first; empty where there is only one."""
    vehicle = built.resolved["plant"].get("vehicle")
    if not isinstance(vehicle, dict) or "parameters" not in vehicle:
        return ()
    function = catalogue.names("vehicles").get(vehicle["kind"])
    if function is None or "parameters" not in inspect.signature(function).parameters:
        return ()
    names = tuple(getattr(sys.modules[function.__module__], "PARAMETERS", ()))
    scenario_set = vehicle["parameters"]
    return (scenario_set, *(name for name in names if name != scenario_set)) if scenario_set in names else ()


def plant_with_set(built: Built, name: str) -> AbstractPlant:
    """The scenario's plant with another parameter set; numbers that the scenario changes stay changed."""
    if name == built.resolved["plant"]["vehicle"]["parameters"]:
        return built.closed_loop.plant
    return _plant(built, {**_vehicle_options(built), "parameters": name})


def published_plants(built: Built) -> dict[str, AbstractPlant]:
    """The scenario's plant with each published parameter set as it is printed, by name; {} where there is only one.

    The layout of the thrusters is that of the scenario. Its own set is among them only if the scenario changes numbers
    of it.
    """
    sets = parameter_sets(built)
    if not sets:
        return {}
    vehicle = _vehicle_options(built)
    options = inspect.signature(catalogue.find("vehicles", vehicle["kind"])).parameters
    printed = {key: value for key, value in vehicle.items() if key == "kind" or key in options}
    names = sets[1:] if len(printed) == len(vehicle) else sets
    return {name: _plant(built, {**printed, "parameters": name}) for name in names}


def _vehicle_options(built: Built) -> dict[str, Any]:
    """The vehicle of a scenario as the scenario describes it: its kind, and what is given of its options."""
    vehicle = built.scenario.plant.model_dump().get("vehicle", built.resolved["plant"]["vehicle"])
    return {"kind": vehicle} if isinstance(vehicle, str) else dict(vehicle)


def _plant(built: Built, vehicle: dict[str, Any]) -> AbstractPlant:
    """The scenario's plant with another vehicle."""
    options = {**built.scenario.plant.model_dump(), "vehicle": vehicle}
    return factory.make("plants", options, built.text.folder)[0]
