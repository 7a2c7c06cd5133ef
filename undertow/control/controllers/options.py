"""Options that laws have in common: what they are designed for, and how a demanded acceleration becomes an input."""

import dataclasses
from typing import Any

from undertow.core.option_groups import OptionGroup

# Random walk of the loads that a law assumes unless it is given, m/s^2 and rad/s^2 per sqrt(s).
LOAD_RATE = 0.25


@dataclasses.dataclass(frozen=True)
class DesignConditions(OptionGroup):
    """What a law is designed for: the loop in which it runs, its measurements and its disturbances.

    Attributes:
        sampling_time: that of the loop, s; a scenario sets it.
        velocity_noise: standard deviation of the measured velocities at each sampling time, m/s and rad/s; one number
            or one per axis; a scenario sets it from its navigation.
        load_rate: random walk of the loads, m/s^2 and rad/s^2 per sqrt(s); used only with noise.
        delay: uncompensated delay of measurement and input together, s.
    """

    sampling_time: float = 1e-3
    velocity_noise: Any = 0.0
    load_rate: Any = LOAD_RATE
    delay: float = 0.0


@dataclasses.dataclass(frozen=True)
class ActuationOptions(OptionGroup):
    """How a demanded acceleration becomes an input.

    Attributes:
        feedforward: whether weight, buoyancy, drag and the other modelled forces are compensated.
        motor: steady, the voltage is that of the thrust in steady state, or computed, the motor's lag is compensated.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of the natural frequency of the
            tracking error, 2 at most; 0 for no filter.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: 0.15 per sampling time.
        direction: cost of a departure from the desired direction, where limits bind, relative to a loss of size.
    """

    feedforward: bool = True
    motor: str = "steady"
    reference_frequency: Any = None
    actuator_rate: Any = None
    direction: Any = 1.0
