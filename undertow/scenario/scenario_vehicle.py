"""The vehicle of a scenario, and how sure its file is of it."""

from undertow.core.errors import BadInput
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.scenario.reading import Text
from undertow.scenario.uncertain_number import UncertainNumber
from undertow.scenario.vehicle_file import vehicle_file_of

_STATION = {"kind": "setpoint", "position": [0.0] * 6}


def with_reference(scenario: Text) -> Text:
    """A scenario of which only the vehicle matters: where it says no reference, it keeps station."""
    return scenario._replace(data={"reference": _STATION} | scenario.data)


def vehicle_of(built: Built) -> HybridVehicle:
    """The plant of a scenario.

    Raises:
        BadInput: it is no vehicle with thrusters.
    """
    plant = built.closed_loop.plant
    if not isinstance(plant, HybridVehicle):
        raise BadInput("plant", "be a vehicle with thrusters", f"a {type(plant).__name__}")
    return plant


def deviations_in(built: Built) -> dict[str, UncertainNumber]:
    """Numbers of the vehicle file that have deviations, by name; {} without any."""
    vehicle_file = vehicle_file_of(built.text)
    return {} if vehicle_file is None or vehicle_file.uncertainty is None else vehicle_file.uncertainty.numbers
