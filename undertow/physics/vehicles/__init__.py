"""Vehicles: equation of motion of the body, and published parameters. One file per vehicle."""

from undertow.core.catalogue import publish
from undertow.physics.vehicles.body import Body as Body
from undertow.physics.vehicles.vehicle import VehicleModel as VehicleModel

__getattr__ = publish(__name__)
