"""Sensors: what a vehicle carries to know where it is. One file each; `navigation` makes a sensor of them."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
