"""Thrust proportional to voltage, T = c_0 V."""

import math

from undertow.physics.thrusters.memoryless import MemorylessThruster


def linear_voltage(
    thrust_per_volt: float = 10.9,
    current_per_thrust: float = 0.072,
    supply: float = math.inf,
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
) -> MemorylessThruster:
    """T = c_0 V, I = c_I T. Defaults go through the steady state of the paper's motor at 10 V.

    Args:
        thrust_per_volt: c_0, N/V.
        current_per_thrust: c_I, A/N.
        supply: voltage limit, V.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
    """
    known = (thrust_per_volt, 1.0, current_per_thrust, thrust_per_volt)
    return MemorylessThruster(*known, supply, dead_zone, dead_zone_kind)  # pyright: ignore[reportArgumentType] - abstract fields are no arguments
