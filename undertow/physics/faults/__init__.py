"""Faults of sensors, thrusters, power, plant and computation. Modes by role; `undertow list faults` shows all."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
