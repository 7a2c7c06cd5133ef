"""Signals that every run records: the variables of its result file, beside those that plant and controller declare."""

from jaxtyping import Array

from undertow.core.signals import Signal

# Values of one instant by name: those of every loop, and those that plant and controller declare.
Signals = dict[str, Array]

# Signals of every loop, computed by `Realization.signals`. `Signal` explains the units.
RECORDED = {
    "position": Signal(("axis",), "[axis]", "position"),
    "velocity": Signal(("axis",), "[axis]/s", "velocity"),
    "measured_position": Signal(("axis",), "[axis]", "position that the controller receives"),
    "measured_velocity": Signal(("axis",), "[axis]/s", "velocity that the controller receives"),
    "reference": Signal(("axis",), "[axis]", "desired position x_d"),
    "error": Signal(("axis",), "[axis]", "tracking error x_d - x"),
    "uncertainty": Signal(("axis",), "[axis]/s^2", "lumped uncertainty d = x_ddot - F - G u, measured"),
    "input": Signal(("actuator",), "[input]", "input applied"),
    "commanded_input": Signal(("actuator",), "[input]", "input commanded"),
    "power": Signal(("actuator",), "W", "electrical power"),
    "saturated": Signal(("actuator",), "1", "1 where the input is at its limit"),
    "bad_readings": Signal((), "1", "readings so far that were not finite: ignored, or replaced by expected values"),
}

# Signals of a loop with faults.
RECORDED_WITH_FAULTS = {
    "acting_input": Signal(("actuator",), "[input]", "input that acts on the plant, faults included"),
    "active_faults": Signal((), "1", "number of faults that are present"),
}
