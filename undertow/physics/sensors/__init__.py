"""Sensors of a vehicle, one file each. The filters of `navigation` estimate the motion from readings."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
