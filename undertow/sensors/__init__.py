"""Sensors of a vehicle, one file each. `navigation/observer.py` estimates the state from their readings."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
