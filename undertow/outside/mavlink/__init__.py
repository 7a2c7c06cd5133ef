"""The controller of a scenario as a MAVLink companion of an autopilot: odometry in, commands to the thrusters out.

`odometry` reads positions and attitudes, `actuator_commands` writes what the thrusters get, `companion` has the rules
of when a controller may run, `link` the UDP socket, `signing` the signatures, and `companion_link` makes them a link of
the real-time loop.
docs/how-to/mavlink.md explains them.
"""

import importlib.util

if importlib.util.find_spec("pymavlink") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[mavlink]'"
    raise ModuleNotFoundError(f"pymavlink is not installed. {remedy}", name="pymavlink")

from undertow.outside.mavlink.companion import Companion as Companion
from undertow.outside.mavlink.companion_link import CompanionLink as CompanionLink
from undertow.outside.mavlink.link import UdpLink as UdpLink
from undertow.outside.mavlink.signing import read_key as read_key
