"""Meaning and unit of each metric, for tables, reports and `undertow describe metrics`."""

from typing import NamedTuple


class Meaning(NamedTuple):
    """One metric: its meaning in words and its unit, with `[input]` for that of the plant's input."""

    meaning: str
    unit: str


def unit_of(metric: str, input_unit: str) -> str:
    """Unit of a metric for a plant whose input has a unit."""
    return MEANINGS[metric].unit.replace("[input]", input_unit)


# In the order in which tables show them. Over all axes: root mean square of the axes' own figures.
MEANINGS = {
    "tracking_rms": Meaning("rms of the tracking error x_d - x, angles the short way round", "m, rad"),
    "tracking_max": Meaning("largest tracking error", "m, rad"),
    "estimation_rms": Meaning("rms of d_hat - d", "m/s^2, rad/s^2"),
    "uncertainty_rms": Meaning("rms of the lumped uncertainty d = x_ddot - F - G V", "m/s^2, rad/s^2"),
    "robust_rms": Meaning("rms of the robust term u_r", "m/s^2, rad/s^2"),
    "model_rms": Meaning("rms of the modelling error eps = x_hat_dot - x_dot", "m/s, rad/s"),
    "input_rms": Meaning("rms of the applied input over all inputs", "[input]"),
    "input_peak": Meaning("largest applied input", "[input]"),
    "input_variation": Meaning("total variation of the input per second, mean over inputs (chattering)", "[input]/s"),
    "weights_peak": Meaning("largest |theta|; it shows parameter drift", "m/s^2, rad/s^2"),
    "energy": Meaning("electrical energy supplied", "J"),
    # Infinite if it never settles; not defined for a reference that moves until the end.
    "settling_time": Meaning("time after which the reference rests and the error stays within 2 % of the step", "s"),
    "saturated_fraction": Meaning("share of the time, mean over inputs, at which an input is saturated", ""),
    "bad_readings": Meaning("number of readings that were not finite, left out or replaced by expected values", ""),
    "energy_balance_residual": Meaning("residual of the energy balance, share of the energy supplied: rounding", ""),
    "energy_integration_residual": Meaning("the same computed from the state: error of the integrator", ""),
    "rules": Meaning("fuzzy rules per axis", ""),
}

# Metrics that also come per axis, as `<name>_axes`.
PER_AXIS = (
    "tracking_rms",
    "tracking_max",
    "estimation_rms",
    "uncertainty_rms",
    "robust_rms",
    "model_rms",
    "settling_time",
)
