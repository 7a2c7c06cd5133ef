"""The rules by which the vehicle and ArduPilot go in lock step: what each datagram does, whatever it is."""

from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.outside.ardupilot.packets import ServoPacket, reply
from undertow.outside.stepped_vehicle import SteppedVehicle
from undertow.outside.thruster_channels import Channels

# Pulses outside, 0 and 65535 of a channel that is not driven included, are no signal for a speed controller, us.
SIGNAL = 800.0, 2200.0

# s without a packet from the autopilot, after which another one may take its place.
SILENCE = 2.0

_COUNTS = ("frames", "repeated", "late", "lost", "restarts", "invalid", "strangers")


class Session:
    """One autopilot and one vehicle.

    The physics advances by 1 / frame rate for each new frame, never by the clock of the machine. Of a datagram:

    * no packet of the protocol: ignored (`invalid`);
    * from another sender less than `SILENCE` after a packet of the autopilot: ignored (`strangers`), unless it is the
      first frame of another process of the same machine;
    * the frame count of the last one: the autopilot has missed the reply, which is sent again (`repeated`);
    * a smaller frame count: a copy that comes late, or a flipped bit, since the protocol has no checksum: ignored
      (`late`), unless the same or the next one follows it, or none came for `SILENCE`. Then the autopilot was
      restarted, and so is the vehicle (`restarts`);
    * a larger frame count than the next: packets were lost on the way (`lost`); the physics advances by one frame, as
      the autopilot takes its time from the reply.

    A thruster whose channel has no signal (a pulse outside 800 to 2200 us) is off.

    Args:
        vehicle: that is driven; its `depth` is where the surface is, zero where it has none.
        channels: of its thrusters.

    Attributes:
        counts: what happened to the datagrams so far.
        complaint: why the last invalid datagram was ignored; "" without one.
        ended: whether the vehicle cannot go on: its state became invalid. The answer is then the one before.
        sender: of the autopilot; None before the first packet.
        frame_rate: of the last packet, Hz.
        undriven: thrusters without a signal in the last frame.
    """

    def __init__(self, vehicle: SteppedVehicle, channels: Channels):
        self.vehicle = vehicle
        self._channels = channels
        self._depth = vehicle.depth or 0.0
        self._neutral = float(vehicle.esc.neutral)
        self.counts = dict.fromkeys(_COUNTS, 0)
        self.complaint, self.ended, self.frame_rate, self.undriven = "", False, 0, 0
        self.sender: Any = None
        self._last = -1
        self._received = -np.inf
        self._answer = b""
        self._smaller: int | None = None  # frame count that was smaller than the last one

    def answer(self, datagram: bytes, sender: Any, now: float) -> bytes | None:
        """The reply to a datagram; None where it gets none.

        Args:
            datagram: as it arrived.
            sender: its address.
            now: time of any clock, s, which only tells how long the autopilot has been silent.
        """
        try:
            packet = ServoPacket.parsed(datagram)
            pulses, undriven = self._pulses(packet)
        except BadInput as error:
            self.counts["invalid"] += 1
            self.complaint = str(error)
            return None
        from_another = sender != self.sender
        new_process = packet.frame_count == 0 and self.sender is not None and sender[0] == self.sender[0]
        if from_another and now - self._received < SILENCE and not new_process:
            self.counts["strangers"] += 1
            return None
        if not from_another and packet.frame_count < self._last and now - self._received < SILENCE:
            follows = self._smaller is not None and packet.frame_count - self._smaller in (0, 1)
            self._smaller = packet.frame_count
            if not follows:
                self.counts["late"] += 1
                return None
        self._smaller = None
        previous_sender = self.sender
        self.sender = sender
        self._received = now
        if packet.frame_count == self._last and not from_another:
            self.counts["repeated"] += 1
            return self._answer
        self._place(packet.frame_count, from_another and previous_sender is not None)
        self.undriven = undriven
        self._advance(packet, pulses)
        return self._answer

    def _pulses(self, packet: ServoPacket) -> tuple[np.ndarray, int]:
        """Pulses of the thrusters, us, neutral where there is no signal; and how many have none."""
        low, high = SIGNAL
        pwm = np.array(packet.pwm, dtype=float)
        driven = (pwm >= low) & (pwm <= high)
        pulses = self._channels.of_thrusters(np.where(driven, pwm, self._neutral), self._neutral)
        return pulses, int((~driven[self._channels.numbers - 1]).sum())

    def _place(self, frame_count: int, another: bool) -> None:
        """Note what the count of a new frame says: the first one, the next one, a gap, or a restart, which another
        autopilot always is.
        """
        if self._last < 0 or (frame_count == self._last + 1 and not another):
            return
        if frame_count <= self._last or another:
            self.counts["restarts"] += 1
            self.vehicle.restart()
            self.ended = False
        else:
            self.counts["lost"] += frame_count - self._last - 1

    def _advance(self, packet: ServoPacket, pulses: np.ndarray) -> None:
        self._last, self.frame_rate = packet.frame_count, packet.frame_rate
        self.counts["frames"] += 1
        self.ended = not self.vehicle.step(pulses, 1 / packet.frame_rate)
        if not self.ended:
            self._answer = reply(self.vehicle.time, self.vehicle.state(), self._channels, self._depth)
