"""UDP as a link: measurements of a vehicle come in datagrams, commands go out; and a vehicle that answers so."""

import contextlib
import os
import socket
import time
from collections.abc import Callable

import numpy as np

from undertow.core.errors import BadInput, error_location
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.datagrams import COMMAND, MEASUREMENT, MOTION, DatagramFilter, Sender, address_of
from undertow.outside.realtime.link import AbstractLink, LinkMeasurement
from undertow.outside.realtime.process_watchdog import Watchdog
from undertow.outside.realtime.vehicle_link import VehicleLink
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built

_LONGEST = 2048  # bytes of a datagram that are read: none of ours comes near
_AT_ONCE = 256  # datagrams that are read in one step; a flood waits, and is lost where the buffer is full
_LAST = 3  # times that the safe output is sent: any of them may be lost


class UdpVehicleLink(AbstractLink):
    """A vehicle at HOST:PORT. Datagrams from elsewhere, or that cannot be used, are counted and left out.

    Until control begins, commands with the safe output and the flag "control has not begun" go to the vehicle once per
    period, so that it knows where to send its measurements. The newest measurement counts.

    Args:
        address: HOST:PORT.
        built: the scenario.

    Raises:
        BadInput: no such host, or the plant is no vehicle.
    """

    def __init__(self, address: str, built: Built):
        _check_vehicle(built)
        host, port = address_of(address, "--link")
        self.form = Format("quaternion", "body")
        self._actuators = built.closed_loop.plant.inputs()
        try:
            self._peer = socket.gethostbyname(host), port
        except (OSError, UnicodeError):
            raise BadInput("--link", "name a host that is known", host) from None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._received = DatagramFilter(MEASUREMENT, self._actuators)
        self._sender = Sender(COMMAND, self._actuators, int.from_bytes(os.urandom(4), "little"))
        self._sent = self._unsent = self._foreign = 0
        self._watchdog: Watchdog | None = None
        self._safe = np.zeros(self._actuators)

    def fileno(self) -> int:
        """Of the socket: `select` can wait for datagrams."""
        return self._socket.fileno()

    def receive(self, elapsed: float) -> LinkMeasurement | None:
        newest = None
        for _ in range(_AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(_LONGEST)
            except OSError:  # nothing there, or the vehicle does not listen
                break
            if sender != self._peer:
                self._foreign += 1
                continue
            datagram = self._received.take(data)
            newest = newest if datagram is None else datagram
        else:
            self._received.counts["left unread"] += 1
        if newest is None:
            return None
        motion = newest.values[:MOTION]
        applied = newest.values[MOTION:]
        return LinkMeasurement(motion[:3], motion[7:], motion[3:7], applied=applied if newest.flag else None)

    def guard(self, safe: np.ndarray, longest: float) -> None:
        self._safe, self._watchdog = safe, Watchdog(self._socket, longest)

    def send(self, command: np.ndarray) -> None:
        if self._watchdog is not None:
            self._watchdog.hold(self._peer, self._sender.following(self._safe, time.monotonic_ns(), _LAST))
        self._send(command, False)

    def await_measurement(self, safe: np.ndarray) -> None:
        self._send(safe, True)

    def _send(self, command: np.ndarray, waiting: bool) -> None:
        newest = self._received.newest
        answered = 0 if newest is None else newest.sequence
        try:
            self._socket.sendto(self._sender.pack(command, time.monotonic_ns(), answered, waiting), self._peer)
            self._sent += 1
        except OSError:  # such as while a cable is unplugged
            self._unsent += 1

    def finish(self, safe: np.ndarray) -> None:
        for _ in range(_LAST):
            self._send(safe, False)
        if self._watchdog is not None:
            self._watchdog.done()
        self._socket.close()

    def counts(self) -> dict[str, int]:
        return {"sent": self._sent, "not sent": self._unsent, "another sender": self._foreign} | self._received.counts


class UdpVehicleServer:
    """The vehicle of a scenario behind UDP, in lock step: each command is held for one sampling time, and answered.

    Commands before control has begun are answered with the measurement at the start.

    Args:
        built: the scenario.
        address: HOST:PORT to listen on.

    Attributes:
        last_command: that was received last.

    Raises:
        BadInput: the address cannot be used, or the plant is no vehicle.
    """

    def __init__(self, built: Built, address: str):
        _check_vehicle(built)
        self._period = float(built.scenario.loop.dt)
        self._actuators = built.closed_loop.plant.inputs()
        self._received = DatagramFilter(COMMAND, self._actuators)
        self._sender = Sender(MEASUREMENT, self._actuators, int.from_bytes(os.urandom(4), "little"))
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(address_of(address, "--serve"))
        except (OSError, UnicodeError) as error:
            self._socket.close()
            hint = "Another program may be listening there"
            reason = getattr(error, "strerror", None) or "no such host"
            raise BadInput("--serve", "be free to use", f"{address}: {reason}", hint=hint) from None
        except BadInput:
            self._socket.close()
            raise
        self._vehicle = VehicleLink(built)
        self._measurement = self._vehicle.receive(0.0)
        self.last_command = np.full(self._actuators, np.nan)

    @property
    def ended(self) -> str:
        """Why the vehicle does not go on; "" while it does."""
        return self._vehicle.ended

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def counts(self) -> dict[str, int]:
        """Datagrams received and refused, by reason."""
        return dict(self._received.counts)

    def serve(self, until: Callable[[], bool], longest: float = 0.05) -> None:
        """Answer until a function says so, or the vehicle fails; the function is asked every `longest` s at least."""
        self._socket.settimeout(longest)
        while not until() and not self._vehicle.ended:
            try:
                data, sender = self._socket.recvfrom(_LONGEST)
            except OSError:  # nothing came, or the controller does not listen
                continue
            command = self._received.take(data)
            if command is None:
                continue
            self.last_command = command.values
            if not command.flag:
                self._vehicle.send(command.values)
                self._measurement = self._vehicle.receive(self._period)
            self._answer(command.sequence, sender)

    def _answer(self, sequence: int, sender: tuple[str, int]) -> None:
        measurement = self._measurement
        input_known = measurement.applied is not None
        applied = measurement.applied if input_known else np.zeros(self._actuators)
        # Of `both` and `both`: the quaternion follows the Euler angles, and body velocity the rates.
        values = np.concatenate([measurement.position, measurement.attitude[3:], measurement.velocity[6:], applied])
        with contextlib.suppress(OSError):
            self._socket.sendto(
                self._sender.pack(values, round(1e9 * self._vehicle.time), sequence, input_known), sender
            )


def _check_vehicle(built: Built) -> None:
    with error_location(location=built.text.location):
        if not isinstance(built.closed_loop.plant, HybridVehicle):
            raise BadInput("plant", "be a vehicle with thrusters for a link by UDP", built.scenario.plant.kind)
        if built.scenario.model.options.get("speed_sensor"):
            raise BadInput("model.speed_sensor", "be false: datagrams hold no speeds of propellers", "true")
