"""Asks the autopilot for the messages that the law needs: MAV_CMD_SET_MESSAGE_INTERVAL, until they come."""

from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from undertow.outside.mavlink.actuator_commands import MavlinkTarget
from undertow.outside.mavlink.odometry import MESSAGES

_AGAIN = 1.0  # s from one request to the next: an acknowledgement does not say to which message it belongs
_SILENCE = 3.0  # s without a message that was granted, after which it is asked for again
_PATIENCE = 10.0  # s after a rejection, which may have been meant for somebody else's request
_ENOUGH = 0.7  # share of the required rate, from which on a message counts as coming

_REJECTIONS = (mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED)


class MessageRequests:
    """Requests for messages at the rate of the law, one after the other, once per second.

    A message is asked for once at least, and then until it is granted, or it comes at 70 % of the required rate. One
    that was granted and is silent for 3 s is asked for again: the autopilot may have been restarted. One that was
    refused is asked for again after 10 s.

    Args:
        source: of the odometry, a key of `odometry.MESSAGES`.
        target: whom to ask.
        interval: s between two messages of a kind.
    """

    def __init__(self, source: str, target: MavlinkTarget, interval: float):
        self._target, self._interval = target, interval
        self._names = MESSAGES[source]
        self.begin_again()

    def begin_again(self) -> None:
        """Ask for everything, as of an autopilot that was not there before."""
        self._open = list(self._names)  # to be asked for, the next one first
        self._asked: str | None = None  # last, whose acknowledgement has not come
        self._asked_at = -float("inf")
        self._received = dict.fromkeys(self._names, 0)  # since it was asked for
        self._arrived: dict[str, float] = {}  # last message, or last answer, s
        self._rejections: dict[str, str] = {}

    def note(self, message: Any, now: float) -> None:
        """A message of the autopilot has come.

        Args:
            message: of pymavlink.
            now: time of a clock that never jumps, s.
        """
        name = message.get_type()
        if name in self._received:
            self._received[name] += 1
            self._arrived[name] = now
            self._rejections.pop(name, None)  # somebody else has asked for it
        if name == "COMMAND_ACK" and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._note_answer(message.result, now)

    def due(self, now: float) -> list[Any]:
        """The request that is to be sent now, if one is."""
        if now - self._asked_at < _AGAIN:
            return []
        self._note_what_comes(now)
        self._open += [name for name in self._names if name not in self._open and self._is_silent(name, now)]
        if not self._open:
            return []
        name = self._open[0]
        self._open.append(self._open.pop(0))  # the next one has its turn if this one is not answered
        self._asked, self._asked_at, self._received[name] = name, now, 0
        number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
        microseconds = round(1e6 * self._interval)
        parameters = [float(number), float(microseconds), 0.0, 0.0, 0.0, 0.0, 0.0]
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return [mavlink.MAVLink_command_long_message(*self._target, command, 0, *parameters)]

    def complaint(self) -> str:
        """Which messages the autopilot refuses, in words; "" where it refuses none."""
        refused = ", ".join(f"{name} ({result})" for name, result in self._rejections.items())
        return f"the vehicle refuses to send {refused}" if refused else ""

    def _note_answer(self, result: int, now: float) -> None:
        name = self._asked
        self._asked = None
        if name is None:
            return
        refused = result in _REJECTIONS
        self._rejections.pop(name, None)
        if refused:
            self._rejections[name] = mavlink.enums["MAV_RESULT"][result].name
        if refused or result == mavlink.MAV_RESULT_ACCEPTED:
            self._open.remove(name)
            self._arrived[name] = now  # its silence begins now

    def _note_what_comes(self, now: float) -> None:
        """What comes often enough since it was asked for needs no answer: not every autopilot gives one."""
        name = self._asked
        elapsed = now - self._asked_at
        if name is not None and self._received[name] >= _ENOUGH * elapsed / self._interval:
            self._asked = None
            self._open.remove(name)

    def _is_silent(self, name: str, now: float) -> bool:
        longest = _PATIENCE if name in self._rejections else _SILENCE
        return now - self._arrived.get(name, now) > longest
