"""Navigation: what makes the state that a controller gets out of readings. One file each."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
