"""Whether the vehicle lets a law run: what the heartbeats of its autopilot say, and what the law has seen since."""

from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

HEARTBEAT_TIMEOUT = 3.0  # s without a heartbeat of the vehicle, after which the law stops


class Permission:
    """Armed, and in the flight mode in which the law first ran since then; no failsafe, no leap of the position.

    Args:
        system: id of the vehicle, for words.

    Attributes:
        armed: whether the vehicle is, as far as is known.
    """

    def __init__(self, system: int):
        self._system = system
        self.armed = False
        self._heartbeat = -np.inf
        self._mode: Any = None  # in which the law may run; None until it does
        self._present_mode: Any = None
        self._emergency = self._leapt = False

    def note(self, heartbeat: Any, now: float) -> None:
        """A heartbeat; those of cameras and the like of the same system say that they are no autopilot."""
        if heartbeat.autopilot == mavlink.MAV_AUTOPILOT_INVALID:
            return
        self._heartbeat = now
        self.armed = bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self._emergency = heartbeat.system_status >= mavlink.MAV_STATE_CRITICAL  # failsafes are critical
        self._present_mode = heartbeat.base_mode & ~mavlink.MAV_MODE_FLAG_SAFETY_ARMED, heartbeat.custom_mode
        if not self.armed:
            self._mode, self._leapt = None, False

    @property
    def begun(self) -> bool:
        """Whether the law has run since the vehicle was armed."""
        return self._mode is not None

    def is_present(self, now: float) -> bool:
        """Whether the autopilot is there: its last heartbeat is no older than 3 s."""
        return now - self._heartbeat <= HEARTBEAT_TIMEOUT

    def begin(self) -> None:
        """The law runs from now on: the mode is the one that the pilot gives it."""
        self._mode = self._present_mode

    def note_leap(self) -> None:
        """The position has leapt: the target may be far away now."""
        self._leapt = self.armed

    def why_not(self, now: float) -> str:
        """Why the law may not run; "" where it may."""
        if not self.is_present(now):
            return f"no heartbeat of system {self._system}"
        if not self.armed:
            return "disarmed"
        if self._emergency:
            return "emergency or failsafe of the vehicle"
        if self._mode is not None and self._mode != self._present_mode:
            return "another flight mode: the pilot has taken over"
        return "the position has leapt: disarm and arm to go on" if self._leapt else ""
