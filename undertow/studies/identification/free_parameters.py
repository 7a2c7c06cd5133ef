"""The numbers of a vehicle that logs may determine: names, units, and what is thought of them beforehand.

A parameter is estimated as a number z of which a value is made: value = prior exp(deviation z) where it must be
positive and is compared by ratios, and value = prior + deviation z elsewhere. Beforehand z has mean 0 and variance 1,
so that the information of the data is compared with what was known before in every parameter alike.
"""

import fnmatch
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput, nearest
from undertow.core.measurement import BODY_AXES
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.scenario.scenario_vehicle import deviations_in
from undertow.scenario.uncertain_number import UncertainNumber, log_deviation
from undertow.scenario.vehicle_parameters import unit_of

_GAIN_UNITS = ("N", "N", "N", "N m", "N m", "N m")  # per unit of the input of an axis

# What is thought of numbers of a vehicle file that has no deviations: a share of the value.
_SHARES = {"mass": 0.03, "inertia": 0.3, "added_mass": 0.5, "thruster_gain": 0.15, "reverse_gain": 0.15, "lag": 0.5}
_TYPICAL_SPEED = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])  # m/s, rad/s; at which both kinds of damping are alike
_DAMPING_SHARE = 1.0  # of the damping at that speed
_ARM = 0.03  # m, of the centre of buoyancy
_NET_WEIGHT = 0.02  # of the weight
_DELAY = 0.1  # s, of commands
_SHORTEST_LAG = 0.75  # steps of the integration; it becomes unstable at 0.36, and motors are faster at full speed


class FreeParameter(NamedTuple):
    """A number that is estimated.

    Attributes:
        name: `quadratic_damping.surge`.
        unit: of its value.
        prior: value beforehand.
        deviation: standard deviation beforehand: of the logarithm where `is_ratio`, else in the unit.
        is_ratio: whether it must be positive and is compared by ratios.
        least: smallest value; -infinity where any is possible.
        resolution: smallest standard deviation that the integration allows: of the logarithm where `is_ratio`, else in
            the unit.
    """

    name: str
    unit: str
    prior: float
    deviation: float
    is_ratio: bool = False
    least: float = -math.inf
    resolution: float = 0.0

    def value(self, z):
        """Value of a number of prior variance 1; arrays go through."""
        if self.is_ratio:
            return self.prior * np.exp(self.deviation * z)
        return self.prior + self.deviation * z

    @property
    def least_z(self) -> float:
        """The number that belongs to the smallest value."""
        if not self.is_ratio:
            return (self.least - self.prior) / self.deviation
        return math.log(self.least / self.prior) / self.deviation if self.least > 0 else -math.inf


def parameters_of(plant: HybridVehicle) -> dict[str, FreeParameter]:
    """All numbers of a vehicle that can be free, by name, with the deviations that are usual.

    Args:
        plant: vehicle with thrusters, whose values are the prior ones.
    """
    vehicle = plant.vehicle
    net_buoyancy = float(vehicle.buoyancy - vehicle.weight)
    numbers = [_ratio("mass", vehicle.mass)]
    numbers += _diagonal("inertia", BODY_AXES[3:], vehicle.inertia)
    numbers += _diagonal("added_mass", BODY_AXES, vehicle.added_mass)
    numbers += _damping(vehicle)
    numbers += [_number("net_buoyancy", net_buoyancy, _NET_WEIGHT * float(vehicle.weight))]
    numbers += [_number(f"r_b.{axis}", float(vehicle.r_b[i]), _ARM) for i, axis in enumerate("xyz")]
    numbers += [_ratio("thruster_gain", 1.0)]
    numbers += [_ratio(f"thruster_gain.T{j + 1}", 1.0) for j in range(plant.inputs())]
    numbers += [_ratio("reverse_gain", 1.0), _ratio("lag", 1.0)]
    numbers += [_number("command_delay", 0.0, _DELAY, least=0.0)]
    return {number.name: number for number in numbers}


def axis_parameters(prior_gain: float = 50.0, lag: float = 0.15) -> dict[str, FreeParameter]:
    """Gains and lags of inputs that push along the axes, where it is not known how they reach the thrusters.

    Args:
        prior_gain: force or moment per unit of input beforehand, N and N m; within a factor of e or so.
        lag: of the force, s.
    """
    gains = [
        FreeParameter(f"axis_gain.{axis}", unit, prior_gain * (1.0 if i < 3 else 0.2), 1.0, is_ratio=True)
        for i, (axis, unit) in enumerate(zip(BODY_AXES, _GAIN_UNITS, strict=True))
    ]
    lags = [FreeParameter(f"axis_lag.{axis}", "s", lag, 0.7, is_ratio=True) for axis in BODY_AXES]
    power = FreeParameter("axis_power", "", 1.0, 0.3, is_ratio=True)
    delay = FreeParameter("axis_delay", "s", 0.0, _DELAY)  # negative where the clock of the sticks is late
    return {number.name: number for number in (*gains, *lags, power, delay)}


def _ratio(name: str, value) -> FreeParameter:
    return FreeParameter(name, unit_of(name), float(value), _SHARES[name.split(".")[0]], is_ratio=True)


def _number(name: str, value: float, deviation: float, least: float = -math.inf) -> FreeParameter:
    return FreeParameter(name, unit_of(name), value, deviation, least=least)


def _diagonal(name: str, axes: Sequence[str], matrix) -> list[FreeParameter]:
    """Those of a matrix with positive diagonal entries."""
    entries = np.diagonal(np.asarray(matrix, dtype=float))
    return [_ratio(f"{name}.{axis}", entry) for axis, entry in zip(axes, entries, strict=True) if entry > 0]


def _damping(vehicle) -> list[FreeParameter]:
    """Those of damping, of which each kind may be zero: deviations are shares of both kinds together."""
    linear = np.diagonal(np.asarray(vehicle.linear_damping, dtype=float))
    quadratic = np.diagonal(np.asarray(vehicle.quadratic_damping, dtype=float))
    together = linear + quadratic * _TYPICAL_SPEED
    together = np.where(together > 0, together, np.diagonal(np.asarray(vehicle.mass_matrix(), dtype=float)))
    free = []
    for i, axis in enumerate(BODY_AXES):
        deviation = _DAMPING_SHARE * float(together[i])
        free.append(_number(f"linear_damping.{axis}", float(linear[i]), deviation, least=0.0))
        deviation /= float(_TYPICAL_SPEED[i])
        free.append(_number(f"quadratic_damping.{axis}", float(quadratic[i]), deviation, least=0.0))
    return free


# Free where nothing else is asked for: mass and inertia of the dry vehicle are known, and motion shows only their sum
# with the added ones; gains of single thrusters need long logs.
USUALLY_FREE = (
    "added_mass.*",
    "linear_damping.*",
    "quadratic_damping.*",
    "net_buoyancy",
    "r_b.*",
    "thruster_gain",
    "reverse_gain",
    "lag",
    "axis_gain.*",
    "axis_lag.*",
    "axis_power",
    "axis_delay",
)


def chosen(
    known: Mapping[str, FreeParameter], free: Sequence[str] = (), priors: Mapping[str, UncertainNumber] | None = None
) -> list[FreeParameter]:
    """The parameters that are free, some with another prior.

    Args:
        known: all that can be.
        free: names, groups (`added_mass`) or patterns (`*.yaw`); () for the usual ones.
        priors: by name; these are free, too.

    Raises:
        BadInput: a name that means none, or a prior that its parameter cannot have.
    """
    priors = priors or {}
    asked = tuple(free) or USUALLY_FREE
    names: list[str] = []
    for pattern in (*asked, *priors):
        matching = matching_names(known, pattern)
        if not matching and (free or pattern in priors) and pattern not in USUALLY_FREE:
            raise BadInput("free", "name parameters of the vehicle", pattern, hint=nearest(pattern, known))
        names += [name for name in matching if name not in names]
    return [_with_prior(known[name], priors[name]) if name in priors else known[name] for name in names]


def shortest_lag(plant: HybridVehicle) -> float | None:
    """Time constant of the quickest thruster, s; None of thrusters without a lag, or with an unknown one."""
    time_constant = plant.thruster.actuator_model(plant.inputs(), False).time_constant()
    if time_constant is None or not np.all(np.asarray(time_constant) > 0):
        return None
    return float(np.min(time_constant))


def resolved_by(step: float, plant: HybridVehicle, parameters: Sequence[FreeParameter]) -> list[FreeParameter]:
    """The same parameters, with a lag of the thrusters no shorter, and no surer, than a step of the integration allows.

    The fourth-order step multiplies what a lag leaves of a jump by the first terms of the series of an exponential. An
    estimate makes up for the difference with another lag.
    """
    shortest = shortest_lag(plant)
    if shortest is None:
        return list(parameters)
    steps = step / shortest
    least, left = _SHORTEST_LAG * steps, math.exp(-steps)
    by_series = 1 - steps + steps**2 / 2 - steps**3 / 6 + steps**4 / 24
    resolution = abs(by_series - left) / (steps * left)  # change of the logarithm of the lag with the same effect
    return [p._replace(least=min(least, p.prior), resolution=resolution) if p.name == "lag" else p for p in parameters]


def chosen_in(
    built: Built, known: Mapping[str, FreeParameter], free: Sequence[str], priors: Mapping[str, UncertainNumber]
) -> list[FreeParameter]:
    """The same, where the deviations of the vehicle file of a scenario are priors, too, unless others are given."""
    of_file = {name: number for name, number in deviations_in(built).items() if name in known}
    return chosen(known, free, of_file | dict(priors))


def matching_names(names: Iterable[str], pattern: str) -> list[str]:
    """Names that a name, a group (`added_mass`) or a pattern (`*.yaw`) means."""
    return [name for name in names if fnmatch.fnmatchcase(name, pattern) or _in_group(name, pattern)]


def _in_group(name: str, group: str) -> bool:
    return name.startswith(f"{group}.") and not group == "thruster_gain"


def _with_prior(parameter: FreeParameter, prior: UncertainNumber) -> FreeParameter:
    if not parameter.is_ratio:
        return parameter._replace(prior=prior.value, deviation=prior.deviation)
    if not prior.value > 0:
        raise BadInput(f"priors.{parameter.name}", "be positive", prior.value)
    return parameter._replace(prior=prior.value, deviation=log_deviation(prior))
