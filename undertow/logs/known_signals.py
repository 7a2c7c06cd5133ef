"""Names, columns, units and frames of what a log may hold of a vehicle."""

from typing import NamedTuple

# Frames that a signal may be given in, ours first.
WORLD, BODY = ("NED", "ENU"), ("FRD", "FLU")


class KnownSignal(NamedTuple):
    """What a signal is.

    Attributes:
        columns: names; () of a number; ("thruster",) stands for one column per thruster.
        unit: in which a log holds it.
        kind: how its frame is converted: `world` and `body` (vectors), `attitude` (roll, pitch, yaw), `quaternion`,
            `down` (a depth, which is a height in axes that point up), or "" for nothing to convert.
        meaning: in words.
    """

    columns: tuple[str, ...]
    unit: str
    kind: str
    meaning: str


SIGNALS = {
    "position": KnownSignal(("north", "east", "down"), "m", "world", "position of the body's origin"),
    "attitude": KnownSignal(("roll", "pitch", "yaw"), "rad", "attitude", "Euler angles of the body in the world"),
    "quaternion": KnownSignal(("w", "x", "y", "z"), "1", "quaternion", "attitude as a quaternion, body to world"),
    "velocity": KnownSignal(("north", "east", "down"), "m/s", "world", "velocity in world axes"),
    "body_velocity": KnownSignal(("surge", "sway", "heave"), "m/s", "body", "velocity in body axes"),
    "angular_velocity": KnownSignal(("p", "q", "r"), "rad/s", "body", "angular velocity in body axes"),
    "specific_force": KnownSignal(("forward", "starboard", "down"), "m/s^2", "body", "reading of the accelerometer"),
    "depth": KnownSignal((), "m", "down", "depth, from the pressure"),
    "input": KnownSignal(("thruster",), "V", "", "input applied to each thruster"),
    "commanded_input": KnownSignal(("thruster",), "V", "", "input commanded to each thruster"),
    "thrust": KnownSignal(("thruster",), "N", "", "thrust of each thruster"),
    "pulses": KnownSignal(("thruster",), "us", "", "pulses to the speed controllers"),
    "duty": KnownSignal(("thruster",), "1", "", "command to the speed controllers, from -1 to 1"),
    "propeller_speed": KnownSignal(("thruster",), "rad/s", "", "speed of each propeller"),
}


def thruster_columns(number: int) -> tuple[str, ...]:
    """Names of the columns of a signal that has one per thruster."""
    return tuple(f"T{i + 1}" for i in range(number))
