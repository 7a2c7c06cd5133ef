"""The forms of a thruster that a bench determines, each as parameters, as a part and as a section of a scenario.

`curve` is the part `first_order`: a power of the voltage beyond a dead zone, a gain in reverse, a first-order lag.
`motor` is the part `dc_motor`, where speed and current were measured.
"""

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np

from undertow.physics.thrusters.dc_motor import dc_motor
from undertow.physics.thrusters.first_order import FirstOrderThruster, LaggedThrust, first_order
from undertow.physics.thrusters.motor_thruster import StaticThruster
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.studies.identification.bench.bench_response import BenchResponse, Rows
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.free_parameters import FreeParameter

USUAL_LAG = 0.1  # s, of small thrusters; assumed where none was recorded
_POWER = (1.5, 0.3)  # prior of the power of the voltage, and its deviation as a share
_DEAD_ZONE = 0.06  # of the largest voltage, prior and deviation
_REVERSE = 0.8
_SHARE = 0.3
_GAIN, _CONSTANT, _LAG = 1.0, 0.5, 0.7  # deviations of the logarithm
_DELAY = 0.1  # s
_BACK_EMF = 0.6  # of the largest voltage, at the largest speed

Values = Mapping[str, Any]  # parameters by name


@dataclasses.dataclass(frozen=True)
class ThrusterForm(abc.ABC):
    """A form of the thruster.

    Attributes:
        largest: voltage of the bench, V.
        dead_zone_kind: as of a thruster; that of `pass` is `dead_zone`, that of `subtract` is a parameter.
        dead_zone: V.
        reverse: whether reverse was recorded.
        lagging: whether a record over time is there.
    """

    name: ClassVar[str]
    kind: ClassVar[str]
    measured: ClassVar[tuple[str, ...]]

    largest: float
    dead_zone_kind: str
    dead_zone: float
    reverse: bool
    lagging: bool

    @abc.abstractmethod
    def parameters(self, tables: Sequence[BenchTable]) -> list[FreeParameter]:
        """What is estimated, with what the records make likely at first sight."""

    @abc.abstractmethod
    def part(self, values: Values) -> AbstractThruster:
        """The thruster."""

    @abc.abstractmethod
    def settled(self, values: Values, volts: Rows) -> BenchResponse:
        """What it settles to."""

    @abc.abstractmethod
    def begin(self, values: Values, volts: Rows) -> Any:
        """State of the thruster settled at voltages."""

    @abc.abstractmethod
    def section(self, values: Mapping[str, float], tables: Sequence[BenchTable]) -> dict[str, Any]:
        """Options of the part in a scenario."""

    def motor_current(self, values: Values, response: BenchResponse, thrust: Rows) -> Rows:
        """Current of the motor, A, from a response or, where the form knows no better, from the measured thrust."""
        return response.current

    def dead_zone_of(self, values: Values) -> Any:
        """Dead zone, V."""
        return values.get("dead_zone", self.dead_zone)

    def _common_parameters(self) -> list[FreeParameter]:
        """Dead zone where it is a parameter, and delay of a record."""
        zone = _DEAD_ZONE * self.largest
        parameters = []
        if self.dead_zone_kind == "subtract":
            parameters.append(FreeParameter("dead_zone", "V", zone, zone, least=0.0))
        if self.lagging:
            parameters.append(FreeParameter("delay", "s", 0.0, _DELAY, least=0.0))
        return parameters

    def _dead_zone_options(self, values: Mapping[str, float]) -> dict[str, Any]:
        return {"dead_zone": float(self.dead_zone_of(values)), "dead_zone_kind": self.dead_zone_kind}


@dataclasses.dataclass(frozen=True)
class CurveForm(ThrusterForm):
    """T = c (|V| - d)^p, times a share in reverse, with a first-order lag; current proportional to thrust."""

    name = "curve"
    kind = "first_order"
    measured = ("thrust", "current")

    def parameters(self, tables):
        volts, thrust = joined(tables, "volts"), joined(tables, "thrust")
        forward = volts > 0
        shape = volts[forward] ** _POWER[0]
        gain = float((shape * thrust[forward]).sum() / (shape**2).sum())
        parameters = [
            FreeParameter("thrust_per_volt", "N/V^p", gain, _GAIN, is_ratio=True),
            FreeParameter("power", "", *_POWER, is_ratio=True),
            *self._common_parameters(),
        ]
        if self.reverse:
            parameters.append(FreeParameter("reverse_share", "", _REVERSE, _SHARE, is_ratio=True))
        if self.lagging:
            parameters.append(FreeParameter("time_constant", "s", USUAL_LAG, _LAG, is_ratio=True))
        current, size = np.abs(joined(tables, "current")), np.abs(thrust * joined(tables, "duty"))
        known = np.isfinite(current)
        if known.any():
            ratio = float((current * size)[known].sum() / (size**2)[known].sum())
            parameters.append(FreeParameter("current_per_thrust", "A/N", ratio, _CONSTANT, is_ratio=True))
        return parameters

    def part(self, values) -> FirstOrderThruster:
        return first_order(
            thrust_per_volt=values["thrust_per_volt"],
            time_constant=values.get("time_constant", USUAL_LAG),
            power=values["power"],
            reverse_share=values.get("reverse_share", 1.0),
            current_per_thrust=values.get("current_per_thrust", 1.0),
            linear_gain=1.0,
            dead_zone=self.dead_zone_of(values),
            dead_zone_kind=self.dead_zone_kind,
        )

    def settled(self, values, volts):
        part = self.part(values).settled()
        return BenchResponse(part.thrust((), volts), part.current((), volts), jnp.zeros_like(volts))

    def motor_current(self, values, response, thrust):
        """From the measured thrust, so that a current that is not proportional to it does not bend the curve."""
        return values.get("current_per_thrust", 0.0) * thrust

    def begin(self, values, volts):
        return LaggedThrust(self.part(values).steady_thrust(volts))

    def section(self, values, tables):
        volts, thrust = joined(tables, "volts"), joined(tables, "thrust")
        options = {name: values[name] for name in ("thrust_per_volt", "power")}
        if "current_per_thrust" in values:
            options["current_per_thrust"] = values["current_per_thrust"]
        return {
            "kind": self.kind,
            **options,
            "reverse_share": values.get("reverse_share", 1.0),
            "time_constant": values.get("time_constant", USUAL_LAG),
            "linear_gain": float((volts * thrust).sum() / (volts**2).sum()),
            **self._dead_zone_options(values),
        }


@dataclasses.dataclass(frozen=True)
class MotorForm(ThrusterForm):
    """A DC motor with k_t = k_e and a propeller; its friction counts as torque of the propeller."""

    name = "motor"
    kind = "dc_motor"
    measured = ("thrust", "current", "speed")

    def parameters(self, tables):
        volts, duty = joined(tables, "volts"), joined(tables, "duty")
        thrust, speed = joined(tables, "thrust"), joined(tables, "speed")
        current = joined(tables, "current") / np.maximum(duty, 1e-9)
        known = np.isfinite(speed + current) & (np.abs(volts) > 0.1 * self.largest)
        volts, thrust, speed, current = (array[known] for array in (volts, thrust, speed, current))
        back_emf = _BACK_EMF * self.largest / float(np.abs(speed).max())
        resistance = (1 - _BACK_EMF) * self.largest / float(np.abs(current).max())
        square = speed * np.abs(speed)
        of = lambda values, rows: float((values * square)[rows].sum() / (square**2)[rows].sum())
        forward, reverse = volts > 0, volts < 0
        ratio = lambda name, unit, value, deviation=_CONSTANT: FreeParameter(name, unit, value, deviation, True)
        parameters = [
            ratio("resistance", "ohm", resistance),
            ratio("back_emf_constant", "V s/rad", back_emf),
            ratio("thrust_coefficient", "N s^2/rad^2", of(thrust, forward)),
            ratio("torque_coefficient", "N m s^2/rad^2", back_emf * of(current, forward)),
            *self._common_parameters(),
        ]
        if self.reverse:
            parameters += [
                ratio("reverse_thrust_coefficient", "N s^2/rad^2", of(thrust, reverse)),
                ratio("reverse_torque_coefficient", "N m s^2/rad^2", back_emf * of(current, reverse)),
            ]
        if self.lagging:
            likely = {parameter.name: parameter.prior for parameter in parameters}
            parameters.append(ratio("rotor_inertia", "kg m^2", self._usual_inertia(likely), _LAG))
        return parameters

    def part(self, values):
        return dc_motor(**self._constants(values), fidelity="shaft", **self._zone(values))

    def settled(self, values, volts):
        part = dc_motor(**self._constants(values), fidelity="static", **self._zone(values))
        assert isinstance(part, StaticThruster)
        speed = part.motor.steady_speed(part.terminal(volts))
        return BenchResponse(part.motor.thrust(speed), part.motor.steady_current(speed), speed)

    def begin(self, values, volts):
        part = self.part(values)
        return part.initial_state(len(volts))._replace(speed=self.settled(values, volts).speed)

    def section(self, values, tables):
        constants = {name: value for name, value in values.items() if name not in ("delay", "dead_zone")}
        inertia = values.get("rotor_inertia", self._usual_inertia(values))
        return {"kind": self.kind, **constants, "rotor_inertia": inertia, **self._dead_zone_options(values)}

    def _constants(self, values: Values) -> dict[str, Any]:
        constants = {name: value for name, value in values.items() if name not in ("delay", "dead_zone")}
        return {"rotor_inertia": self._usual_inertia(values), **constants}

    def _zone(self, values: Values) -> dict[str, Any]:
        return {"dead_zone": self.dead_zone_of(values), "dead_zone_kind": self.dead_zone_kind}

    def _usual_inertia(self, values: Values) -> Any:
        """Inertia with which the speed lags by `USUAL_LAG` about half of the full speed, kg m^2."""
        k_e, resistance, torque = (values[name] for name in ("back_emf_constant", "resistance", "torque_coefficient"))
        full_speed = 2 * self.largest / (k_e + (k_e**2 + 4 * resistance / k_e * torque * self.largest) ** 0.5)
        return USUAL_LAG * (k_e + resistance / k_e * torque * full_speed) * k_e / resistance


def joined(tables: Sequence[BenchTable], quantity: str) -> np.ndarray:
    """A quantity of all records, (rows,)."""
    return np.concatenate([getattr(table, quantity) for table in tables])
