"""The contract of a thruster: volts in, thrust out; N of them at once, Eq. (16)."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel, DirectActuator
from undertow.core.param import Param
from undertow.core.runtime import says_single

PerThruster = Float[Array, " N"] | Float[Array, ""]  # one entry per thruster, or one that holds for each

# Effect of a voltage outside the dead zone: all of it (`pass`), or its part beyond the zone (`subtract`).
DEAD_ZONES = ("pass", "subtract")


class PropellerReport(NamedTuple):
    """Report of a propeller-speed sensor: speed (rad/s) and its rate (rad/s^2; None where states do not give it)."""

    speed: PerThruster
    acceleration: PerThruster | None


class Powers(NamedTuple):
    """Power balance of each thruster, W: source + conversion = the others + d(stored)/dt."""

    source: PerThruster  # V I, what the drive takes
    copper: PerThruster  # R I^2
    friction: PerThruster  # k_f Om^2
    water: PerThruster  # Q Om, given to the water
    conversion: PerThruster  # (k_t - k_e) I Om: created power unless k_t = k_e


class AbstractThruster(eqx.Module):
    """A set of N thrusters of one kind; an array has one entry per thruster, or a single one that holds for each."""

    supply: eqx.AbstractVar[Float[Param, "..."]]  # V; the drive can give -supply ... supply
    dead_zone: eqx.AbstractVar[Float[Param, "..."]]  # V; smaller voltages have no effect
    dead_zone_kind = "pass"  # one of DEAD_ZONES; a field where a thruster offers both
    input_unit = "V"  # unit of the command; where this is not V, every voltage below has that unit
    # Whether J_dot nu counts as part of the prescribed uncertainty: the paper's setting, for thrust without dynamics.
    has_prescribed_acceleration = False

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        if "initial_state" in vars(cls):
            cls.initial_state = says_single(cls.initial_state)

    def __check_init__(self):
        checks.not_negative("dead_zone", self.dead_zone, self.input_unit)
        checks.choice("dead_zone_kind", self.dead_zone_kind, DEAD_ZONES)

    @abc.abstractmethod
    def initial_state(self, count: int) -> Any:
        """State of `count` thrusters at rest."""

    @abc.abstractmethod
    def dynamics(self, state: Any, voltage: PerThruster) -> Any:
        """d(state)/dt."""

    @abc.abstractmethod
    def thrust(self, state: Any, voltage: PerThruster) -> PerThruster:
        """T, N."""

    @abc.abstractmethod
    def current(self, state: Any, voltage: PerThruster) -> PerThruster:
        """I, A."""

    @abc.abstractmethod
    def powers(self, state: Any, voltage: PerThruster) -> Powers | None:
        """Power balance; None without a motor model."""

    @abc.abstractmethod
    def stored(self, state: Any) -> PerThruster:
        """Energy in windings and rotors, J; zero at rest."""

    @abc.abstractmethod
    def report(self, state: Any) -> PropellerReport | None:
        """Report of a speed sensor; None where speed is not a state."""

    @abc.abstractmethod
    def voltage_gain(self) -> PerThruster:
        """alpha of Eq. (7), N/V, in the nominal model."""

    @abc.abstractmethod
    def speed_term(self, report: Any) -> PerThruster:
        """phi of Eq. (15), N, from a speed sensor."""

    def actuator_model(self, count: int, measured: bool) -> AbstractActuatorModel:
        """Nominal model of `count` thrusters for the controller; T = alpha V where no better one is known.

        Args:
            count: N.
            measured: whether propeller speeds are reported.
        """
        return DirectActuator(self.voltage_gain(), *self.limits(), at_once=False)

    @abc.abstractmethod
    def advice(self) -> tuple[str, ...]:
        """Advice on implausible parameters."""

    def count(self) -> int | None:
        """How many thrusters there must be, where parameters have one entry per thruster; None for any number."""
        return None

    def limits(self) -> tuple[PerThruster, PerThruster]:
        """Smallest and largest command of the drive, V."""
        return -self.supply, self.supply

    def electrical_power(self, state: Any, voltage: PerThruster) -> PerThruster:
        """Electrical power V I, W: zero without voltage, although a spinning motor may carry a current."""
        return self.terminal(voltage) * self.current(state, voltage)

    def terminal(self, voltage: PerThruster) -> PerThruster:
        """Voltage at the motor, V: zero inside the dead zone; NaN stays NaN.

        Outside, it is V (`pass`), or |V| less the dead zone with the sign of V (`subtract`); the drive loses no power
        with the part that it subtracts.
        """
        size = jnp.abs(voltage)
        inside = (size <= self.dead_zone) & (self.dead_zone > 0)  # without a zone, the slope at 0 V is that around it
        if self.dead_zone_kind == "subtract":
            return jnp.where(inside, 0.0, voltage - jnp.sign(voltage) * self.dead_zone)
        return jnp.where(inside, 0.0, voltage)

    def commanded(self, terminal: PerThruster) -> PerThruster:
        """Command, V, for a voltage at the motor: the inverse of `terminal`.

        A voltage inside the dead zone, which `pass` cannot give, is returned unchanged and has no effect.
        """
        if self.dead_zone_kind == "subtract":
            return terminal + jnp.sign(terminal) * self.dead_zone
        return terminal


class AbstractMotorlessThruster(AbstractThruster):
    """A lagging thruster without a motor model: no energy balance, no speed to report, and a given nominal gain."""

    linear_gain: eqx.AbstractVar[Float[Param, ""]]  # N/V

    def powers(self, state, voltage) -> None:
        return None

    def stored(self, state) -> PerThruster:
        return jnp.zeros(())

    def report(self, state) -> None:
        return None

    def voltage_gain(self):
        return self.linear_gain
