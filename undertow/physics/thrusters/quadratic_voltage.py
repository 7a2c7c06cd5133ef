"""Thrust proportional to the square of the voltage, T = c_V V|V|."""

import math

from undertow.physics.thrusters.memoryless import MemorylessThruster


def quadratic_voltage(
    thrust_per_volt_squared: float = 1.09,
    current_per_thrust: float = 0.072,
    linear_gain: float = 10.9,
    supply: float = math.inf,
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
) -> MemorylessThruster:
    """T = c_V V|V|, I = c_I T. Defaults go through the steady state of the paper's motor at 10 V.

    Args:
        thrust_per_volt_squared: c_V, N/V^2.
        current_per_thrust: c_I, A/N.
        linear_gain: alpha that the controller's model assumes, N/V.
        supply: voltage limit, V.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
    """
    known = (thrust_per_volt_squared, 2.0, current_per_thrust, linear_gain)
    return MemorylessThruster(*known, supply, dead_zone, dead_zone_kind)  # pyright: ignore[reportArgumentType] - abstract fields are no arguments
