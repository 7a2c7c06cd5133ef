"""What a scenario must have for ROS 2."""

from undertow.core.errors import BadInput, error_location
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built


def check_vehicle(built: Built) -> None:
    """Check that a scenario has a vehicle with thrusters in a sampled loop, whose law needs no propeller speeds.

    Raises:
        BadInput: it has not.
    """
    with error_location(location=built.text.location):
        if not isinstance(built.closed_loop.plant, HybridVehicle):
            raise BadInput("plant", "be a vehicle with thrusters", built.scenario.plant.kind)
        if built.scenario.loop.kind != "sampled":
            raise BadInput("loop.kind", "be sampled", built.scenario.loop.kind)
        if built.scenario.model.options.get("speed_sensor"):
            raise BadInput("model.speed_sensor", "be false: there is no message for the speeds of propellers", "true")
