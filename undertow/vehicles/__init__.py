"""Vehicles: the body in the water and the published numbers. One file per vehicle."""

from undertow.core.catalogue import publish
from undertow.vehicles.body import Body as Body
from undertow.vehicles.vehicle import Vehicle as Vehicle

__getattr__ = publish(__name__)
