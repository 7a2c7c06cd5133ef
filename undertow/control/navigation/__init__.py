"""Navigation filters, which estimate the state for the controller from readings. One file each."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
