"""ArduPilot's software in the loop: the vehicle of a scenario as the physics behind ArduSub.

ArduPilot calls it the JSON simulator: a binary packet of servo pulses comes in over UDP, a line of JSON with the sensor
readings of the vehicle goes out. `packets` is the format, `session` the rules of lock step, `server` the socket.
"""

from undertow.outside.ardupilot.packets import ServoPacket as ServoPacket
from undertow.outside.ardupilot.server import listen as listen
from undertow.outside.ardupilot.server import serve as serve
from undertow.outside.ardupilot.session import Session as Session
