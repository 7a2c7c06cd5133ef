"""Plants: systems x_ddot = f + G u + d. The vehicle with its thrusters is one of them."""

from undertow.core.catalogue import publish
from undertow.physics.plants.hybrid_vehicle import HybridVehicle as HybridVehicle

__getattr__ = publish(__name__)
