"""Disturbances: sampled once from a key, then functions of time. One file each."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
