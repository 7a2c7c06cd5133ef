"""Sensors that a vehicle carries. One file each; `navigation/observer.py` makes a state of their readings."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
