"""References: the desired motion. One file each."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
