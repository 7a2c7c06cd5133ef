"""Which servo channel of an autopilot drives which thruster, and in which direction."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.logs.ardusub_frames import FRAMES, motors_of_thrusters

MOST_CHANNELS = 32  # of ArduPilot

_HINT = "Give the channel of each thruster, such as --channels 1,2,-3"


class Channels(NamedTuple):
    """Servo channels of the thrusters of a vehicle.

    Attributes:
        numbers: channel of each thruster, from 1.
        signs: -1 where a pulse above neutral has to push against the direction of the thruster, else 1.
    """

    numbers: NDArray
    signs: NDArray

    def of_thrusters(self, pwm: ArrayLike, neutral: float) -> NDArray:
        """Pulses of the thrusters, us, from those of all channels.

        Raises:
            BadInput: there are fewer channels than the thrusters need.
        """
        pulses = np.asarray(pwm, dtype=float)
        if self.numbers.max() > len(pulses):
            hint = "With SERVO_32_ENABLE = 1 ArduPilot sends 32"
            raise BadInput("channels", f"be of the {len(pulses)} that arrive", str(self.numbers.max()), hint=hint)
        return neutral + self.signs * (pulses[self.numbers - 1] - neutral)

    def of_outputs(self, pulses: ArrayLike, neutral: float) -> dict[int, float]:
        """Pulse (or another signal about its neutral value) by number of the channel, from those of the thrusters."""
        channel_pulses = neutral + self.signs * (np.asarray(pulses, dtype=float) - neutral)
        return dict(zip(self.numbers.tolist(), channel_pulses.tolist(), strict=True))

    def __str__(self) -> str:
        return ",".join(str(number) for number in (self.signs * self.numbers).tolist())


def channels_from_text(text: str, thrusters: int) -> Channels:
    """Channels as a user writes them: `1,2,-3` for three thrusters, the third of which turns the other way.

    Raises:
        BadInput: not one channel for each thruster, or a channel twice or out of range.
    """
    try:
        signed_numbers = np.array([int(word) for word in text.split(",")])
    except ValueError:
        raise BadInput("channels", "be whole numbers with commas, such as 1,2,-3", repr(text)) from None
    checks.length("channels", signed_numbers, thrusters, "one per thruster, negative where it turns the other way")
    numbers = np.abs(signed_numbers)
    if not ((numbers >= 1) & (numbers <= MOST_CHANNELS)).all():
        raise BadInput("channels", f"be from 1 to {MOST_CHANNELS}", text)
    if len(set(numbers.tolist())) < len(numbers):
        raise BadInput("channels", "be different", text)
    return Channels(numbers, np.sign(signed_numbers))


def channels_of_frame(frame: str, thruster_matrix: ArrayLike) -> Channels:
    """Channels of a vehicle whose thrusters are the motors of a frame of ArduSub, in any order and direction.

    A thruster is the motor that pushes as it does in every axis that the motor acts on.

    Args:
        frame: one of FRAMES.
        thruster_matrix: force and moment per newton of each thruster, (6, N), body axes forward, starboard, down.

    Raises:
        BadInput: there is no such frame, or its motors are not the thrusters of the vehicle.
    """
    return Channels(*motors_of_thrusters(frame, thruster_matrix, _HINT))


def channels_of_vehicle(thruster_matrix: ArrayLike, frame: str | None = None, channels: str | None = None) -> Channels:
    """Channels as given, or of a frame; of the frame with as many motors where neither is given.

    Raises:
        BadInput: as above, or both are given, or no frame has as many motors.
    """
    thrusters = np.shape(thruster_matrix)[1]
    if channels is not None:
        if frame is not None:
            raise BadInput("frame", "be left out with `channels`", frame)
        return channels_from_text(channels, thrusters)
    frames = [name for name, motors in FRAMES.items() if len(motors) == thrusters]
    if frame is None and not frames:
        raise BadInput("channels", f"be given for {thrusters} thrusters, which no known frame has", hint=_HINT)
    return channels_of_frame(frame or frames[0], thruster_matrix)
