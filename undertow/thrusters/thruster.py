"""What a thruster is to the rest of undertow: volts in, thrust out; N of them at once, Eq. (16)."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel, DirectActuator

PerThruster = Float[Array, " N"]

# What is left of a voltage outside the dead zone: the whole of it, or what is beyond the zone.
DEAD_ZONES = ("pass", "subtract")


class PropellerReport(NamedTuple):
    """What a propeller-speed sensor tells: speed (rad/s) and its rate (rad/s^2; None where states do not give it)."""

    speed: PerThruster
    acceleration: PerThruster | None


class Powers(NamedTuple):
    """Where each thruster's power comes from and goes, W: source + conversion = the others + d(stored)/dt."""

    source: PerThruster  # V I, what the drive takes
    copper: PerThruster  # R I^2
    friction: PerThruster  # k_f Om^2
    water: PerThruster  # Q Om, given to the water
    conversion: PerThruster  # (k_t - k_e) I Om, out of nothing unless k_t = k_e


class AbstractThruster(eqx.Module):
    """A set of N thrusters of one kind; every array has one entry per thruster."""

    supply: eqx.AbstractVar[Float[Array, ""]]  # V; the drive can give -supply ... supply
    dead_zone: eqx.AbstractVar[Float[Array, ""]]  # V; smaller voltages turn nothing
    dead_zone_kind = "pass"  # one of DEAD_ZONES; a field where a thruster offers both
    input_unit = "V"  # of what it is commanded with; where this is not V, read every voltage below in that unit
    # Whether J_dot nu counts as part of the prescribed uncertainty: the paper's setting, `ideal` and `static`.
    has_prescribed_acceleration: eqx.AbstractVar[bool]

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
        """Where the power goes; None where no motor stands behind the thrust."""

    @abc.abstractmethod
    def stored(self, state: Any) -> PerThruster:
        """Energy in windings and rotors, J; zero at rest."""

    @abc.abstractmethod
    def report(self, state: Any) -> PropellerReport | None:
        """What a speed sensor would tell; None where speed is not a state."""

    @abc.abstractmethod
    def voltage_gain(self) -> Float[Array, ""]:
        """alpha of Eq. (7), N/V: what the controller's model takes for granted."""

    @abc.abstractmethod
    def speed_term(self, report: Any) -> PerThruster | Float[Array, ""]:
        """phi of Eq. (15), N, from a speed sensor."""

    def actuator_model(self, count: int, measured: bool) -> AbstractActuatorModel:
        """What a controller may know of `count` of them, to make them obey; T = alpha V where nothing better is known.

        Args:
            count: N.
            measured: whether propeller speeds are reported.
        """
        return DirectActuator(self.voltage_gain(), *self.limits(), at_once=False)

    @abc.abstractmethod
    def advice(self) -> tuple[str, ...]:
        """What is odd about this thruster."""

    def limits(self) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """Smallest and largest command that the drive can carry out, V."""
        return -self.supply, self.supply

    def electrical_power(self, state: Any, voltage: PerThruster) -> PerThruster:
        """Electrical power, W: no voltage, no power, though a spinning motor may carry a current."""
        return self.terminal(voltage) * self.current(state, voltage)

    def terminal(self, voltage: PerThruster) -> PerThruster:
        """Voltage, V, that turns the motor: zero inside the dead zone; what is not a number stays so.

        Outside, it is the whole voltage (`pass`), or |V| less the dead zone with the sign of V (`subtract`); the drive
        loses no power with what it subtracts.
        """
        size = jnp.abs(voltage)
        inside = (size <= self.dead_zone) & (self.dead_zone > 0)  # without a zone, 0 V has the slope of its neighbours
        if self.dead_zone_kind == "subtract":
            return jnp.where(inside, 0.0, voltage - jnp.sign(voltage) * self.dead_zone)
        return jnp.where(inside, 0.0, voltage)

    def commanded(self, terminal: PerThruster) -> PerThruster:
        """Command, V, for a voltage that is to turn the motor: `terminal` solved.

        A voltage that `pass` cannot give, since it is inside the dead zone, is returned as it is, and turns nothing.
        """
        if self.dead_zone_kind == "subtract":
            return terminal + jnp.sign(terminal) * self.dead_zone
        return terminal
