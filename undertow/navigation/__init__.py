"""Sensors: what stands between the truth and the measurement. One file each."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
