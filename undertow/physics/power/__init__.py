"""Power supply of the thrusters: battery, electronic speed controllers and energy balance. One file per part."""

from undertow.core.catalogue import publish
from undertow.physics.power.battery import Battery as Battery
from undertow.physics.power.esc import ESC as ESC

__getattr__ = publish(__name__)
