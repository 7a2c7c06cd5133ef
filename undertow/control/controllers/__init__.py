"""Controllers. They use a nominal model, never the plant. A new one: docs/how-to/your-own-controller.md."""

from undertow.control.controllers.composite_law import RCAF as RCAF
from undertow.core.catalogue import publish

__getattr__ = publish(__name__)

WITH_PRESETS = ("rcaf", "cascade")
