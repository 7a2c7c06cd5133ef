"""What the parameters of an ArduPilot vehicle say of its log: barometer, channels and directions of the motors.

Source: parameters of ArduSub (ardupilot.org/sub/docs/parameters.html) and SRV_Channel.h.
"""

import re
from collections.abc import Mapping

from undertow.logs.recording import Recording

# SERVOn_FUNCTION of the motors: 33 to 40 are motors 1 to 8, 82 to 85 motors 9 to 12.
_MOTORS = {number: number - 32 for number in range(33, 41)} | {number: number - 73 for number in range(82, 86)}
_FUNCTION = re.compile(r"SERVO(\d{1,2})_FUNCTION")

# Names of the messages of the barometers before they were numbered, as until ArduSub 4.0.
_BAROMETERS = ("BARO", "BAR2", "BAR3")

# Messages with the pulses of the channels, and the columns of these.
_PULSES = {"ArduPilot": ("RCOU", "C{}"), "MAVLink": ("SERVO_OUTPUT_RAW", "servo{}_raw")}


def motor_channels(parameters: Mapping[str, float]) -> dict[int, int]:
    """Channel of each motor, by the number of the motor and in its order; empty where the file does not say so."""
    channels = {}
    for name, value in parameters.items():
        channel = _FUNCTION.fullmatch(name)
        if channel and value in _MOTORS:
            channels[_MOTORS[int(value)]] = int(channel[1])
    return dict(sorted(channels.items()))


def motor_direction(parameters: Mapping[str, float], motor: int) -> int:
    """-1 where a motor pushes the other way at a pulse above neutral than its frame has it, else 1."""
    return -1 if parameters.get(f"MOT_{motor}_DIRECTION", 1.0) < 0 else 1


def pulse_columns(recording: Recording) -> tuple[str, dict[int, str]]:
    """The message that has the pulses of the channels, and its columns by channel; "" where the format has none."""
    topic, form = _PULSES.get(recording.format, ("", ""))
    held = recording.find(topic) if topic else None
    if held is None:
        return "", {}
    columns = {channel: form.format(channel) for channel in range(1, 33)}
    return topic, {channel: column for channel, column in columns.items() if column in held[1].fields}


def barometers(recording: Recording) -> list[str]:
    """Messages of the barometers that a file has, the first one first."""
    return [topic for topic, table in recording.tables.items() if table.kind in _BAROMETERS]


def primary_barometer(recording: Recording) -> str | None:
    """Messages of the barometer that the autopilot takes the depth from; "" where the file has none of that one.

    On an ArduSub vehicle barometer 0 is usually that of the board, in the air of the hull. None where the file has no
    parameters.
    """
    parameters = recording.parameters
    number = parameters.get("BARO_PRIMARY", parameters.get("GND_PRIMARY"))  # the second until ArduSub 4.0
    if number is None:
        return None
    names = [f"BARO[{number:g}]", *(name for i, name in enumerate(_BAROMETERS) if i == number)]
    return next((name for name in names if name in recording.tables), "")
