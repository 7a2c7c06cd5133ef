"""The loop of a scenario linearised at operating points along its reference, and its margins there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import OperatingConditions
from undertow.analysis.linearization.equilibrium import Equilibrium, equilibrium
from undertow.studies.prediction.operating_point import OperatingPoint, input_limits

# Quantiles of the loads along the reference at which the loop is linearised.
_SHARES = (0.1, 0.5, 0.9)
_LONGEST = 10.0  # s, of margins


class LinearizedPoint(NamedTuple):
    """One operating point."""

    where: str
    flow: float | None  # speed of the water past the vehicle, m/s; None for other plants
    at: Equilibrium  # with its load, m/s^2 or rad/s^2, and its input
    used: float  # largest |u| as a share of its limit; 0 without a limit
    poles: np.ndarray  # 1/s
    radius: float  # spectral radius over one control step; stable below 1
    growing: str  # output whose error has most of the mode with that radius
    pole: complex  # of that mode, 1/s

    @property
    def found(self) -> bool:
        """Whether the equilibrium exists."""
        return self.at.found


def linearized_points(op_point: OperatingPoint) -> tuple[LinearizedPoint, ...]:
    """The loop at small, middle and large loads along its reference."""
    return tuple(_point(op_point, conditions) for conditions in op_point.around.operating_points(_SHARES))


def nearest_to_instability(points: Sequence[LinearizedPoint]) -> LinearizedPoint:
    """The point with the largest spectral radius, of those with an equilibrium where there are any."""
    return max([point for point in points if point.found] or points, key=lambda point: point.radius)


def _point(op_point: OperatingPoint, acting: OperatingConditions) -> LinearizedPoint:
    loop, settings = op_point.built.closed_loop, op_point.built.scenario.loop
    at = equilibrium(loop, settings.dt, op_point.mean.parts.target.position, acting.load, acting.flow)
    linear = margins.closed(at, settings.dt, settings.kind)
    low, high = input_limits(op_point.built, at)
    used = np.abs(at.at["u"]) / np.where(at.at["u"] < 0, -low, high)
    speed = None if acting.flow is None else float(np.linalg.norm(acting.flow))
    radius = margins.spectral_radius(linear)
    output, pole = margins.fastest_growing_error(linear, radius)
    return LinearizedPoint(
        where=acting.where,
        flow=speed,
        at=at,
        used=float(used.max()),
        poles=margins.poles(linear),
        radius=radius,
        growing=loop.plant.outputs[output],
        pole=pole,
    )


def robustness(point: LinearizedPoint, dt: float) -> dict[str, float]:
    """Margins at a point: sampling time, further delay and lag, s, and factors on the effect of the input.

    There are none without an equilibrium, where slopes mean nothing.
    """
    if not point.found:
        return {"sampling_time": 0.0, "delay": 0.0, "lag": 0.0, "gain_low": 1.0, "gain_high": 1.0}
    at = point.at
    low, high = margins.gain_range(at, dt)
    return {
        "sampling_time": margins.largest_sampling_time(at, dt, _LONGEST),
        "delay": margins.largest_delay(at, dt, _LONGEST),
        "lag": margins.largest_lag(at, dt, _LONGEST),
        "gain_low": low,
        "gain_high": high,
    }
