"""What the thrusters get, as MAVLink messages; each way needs other settings of the autopilot (docs/how-to/mavlink.md).

| output | message | autopilot |
|---|---|---|
| `rc_override` | RC_CHANNELS_OVERRIDE, pulses | ArduPilot with SERVOn_FUNCTION = RCINn |
| `servo` | COMMAND_LONG, MAV_CMD_DO_SET_SERVO, a pulse each | ArduPilot with SERVOn_FUNCTION = 0 |
| `actuator` | COMMAND_LONG, MAV_CMD_DO_SET_ACTUATOR, shares of six outputs each | PX4, Peripheral via Actuator Set n |
| `control_target` | SET_ACTUATOR_CONTROL_TARGET, shares of eight outputs each | PX4 before 1.14 |

A share is -1 ... 1 of the span of the speed controllers.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from undertow.core import checks
from undertow.core.errors import BadInput

_RC_CHANNELS, _RC_OUTPUTS = 18, 16  # of the message, and functions RCIN1 to RCIN16 of ArduPilot
_IGNORED = 65535  # the autopilot keeps what it has of an RC channel
_PER_COMMAND, _PER_GROUP = 6, 8  # outputs of MAV_CMD_DO_SET_ACTUATOR and SET_ACTUATOR_CONTROL_TARGET
_ACTUATORS, _CONTROLS = 2 * _PER_COMMAND, 2 * _PER_GROUP


class MavlinkTarget(NamedTuple):
    """To whom commands go."""

    system: int
    component: int = mavlink.MAV_COMP_ID_AUTOPILOT1


class Pulses(NamedTuple):
    """Pulses by number of the channel, us, and what they mean."""

    by_channel: Mapping[int, float]
    neutral: float
    span: float

    def shares(self) -> dict[int, float]:
        """-1 ... 1 by number of the channel."""
        share = lambda pulse: float(np.clip((pulse - self.neutral) / self.span, -1, 1))
        return {channel: share(pulse) for channel, pulse in self.by_channel.items()}


Commands = Callable[[MavlinkTarget, Pulses, int], list[Any]]


def rc_override(target: MavlinkTarget, pulses: Pulses, time_usec: int) -> list[Any]:
    """One RC_CHANNELS_OVERRIDE; other channels stay as they are."""
    channels = [_IGNORED] * _RC_CHANNELS
    for channel, pulse in pulses.by_channel.items():
        channels[channel - 1] = round(pulse)
    return [mavlink.MAVLink_rc_channels_override_message(*target, *channels)]


def servo(target: MavlinkTarget, pulses: Pulses, time_usec: int) -> list[Any]:
    """A MAV_CMD_DO_SET_SERVO for each channel."""
    return [
        _command(target, mavlink.MAV_CMD_DO_SET_SERVO, [channel, round(pulse), 0, 0, 0, 0, 0])
        for channel, pulse in pulses.by_channel.items()
    ]


def actuator(target: MavlinkTarget, pulses: Pulses, time_usec: int) -> list[Any]:
    """A MAV_CMD_DO_SET_ACTUATOR for each six outputs; NaN leaves an output as it is."""
    blocks = _blocks(pulses.shares(), _PER_COMMAND, np.nan)
    return [_command(target, mavlink.MAV_CMD_DO_SET_ACTUATOR, [*values, index]) for index, values in blocks.items()]


def control_target(target: MavlinkTarget, pulses: Pulses, time_usec: int) -> list[Any]:
    """A SET_ACTUATOR_CONTROL_TARGET for each group of eight controls."""
    blocks = _blocks(pulses.shares(), _PER_GROUP, 0.0)
    make_message = mavlink.MAVLink_set_actuator_control_target_message
    return [make_message(time_usec, group, *target, values) for group, values in blocks.items()]


# Word of the option -> commands, and the highest channel that they reach.
OUTPUTS: dict[str, tuple[Commands, int]] = {
    "rc_override": (rc_override, _RC_OUTPUTS),
    "servo": (servo, 32),
    "actuator": (actuator, _ACTUATORS),
    "control_target": (control_target, _CONTROLS),
}


def commands_of(output: str, highest: int) -> Commands:
    """The commands of an output.

    Args:
        output: one of OUTPUTS.
        highest: channel of the thrusters.

    Raises:
        BadInput: there is no such output, or it does not reach the channel.
    """
    checks.choice("output", output, tuple(OUTPUTS))
    commands, most = OUTPUTS[output]
    if highest > most:
        raise BadInput("channels", f"be at most {most} with {output}", str(highest))
    return commands


def _command(target: MavlinkTarget, command: int, parameters: list[float]) -> Any:
    return mavlink.MAVLink_command_long_message(*target, command, 0, *map(float, parameters))


def _blocks(values: Mapping[int, float], size: int, empty: float) -> dict[int, list[float]]:
    """Values by block of channels; `empty` for channels between."""
    blocks: dict[int, list[float]] = {}
    for channel, value in sorted(values.items()):
        block, index = divmod(channel - 1, size)
        blocks.setdefault(block, [empty] * size)[index] = value
    return blocks
