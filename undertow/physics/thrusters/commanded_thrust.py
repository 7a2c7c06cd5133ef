"""A thruster commanded in newtons: limits of thrust in each direction and a first-order lag."""

import math

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator, LaggedActuator
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.thrusters.first_order import LaggedThrust
from undertow.physics.thrusters.thruster import AbstractMotorlessThruster, PerThruster


class CommandedThrust(AbstractMotorlessThruster):
    """tau T_dot = T_c - T with T_c the limited command, and |T_dot| limited; there is no motor model.

    Raises:
        BadInput: a limit or the time constant is not positive, or the power negative.
    """

    thrust_forward_max: Float[Param, ""] = param("N", "largest thrust forward", symbol="T+")
    thrust_reverse_max: Float[Param, ""] = param("N", "largest thrust in reverse, as a positive number", symbol="T-")
    time_constant: Float[Param, ""] = param("s", "time to 63 % of a step of thrust", symbol="tau")
    thrust_rate_max: Float[Param, ""] = param("N/s", "fastest change of thrust", default=jnp.inf)
    power_per_thrust: Float[Param, ""] = param("W/N", "electrical power per commanded thrust", default=0.0)
    input_unit = "N"

    def __check_init__(self):
        for name in ("thrust_forward_max", "thrust_reverse_max"):
            checks.positive(name, getattr(self, name), "N", finite=False)
        checks.positive("time_constant", self.time_constant, "s")
        checks.positive("thrust_rate_max", self.thrust_rate_max, "N/s", finite=False)
        checks.not_negative("power_per_thrust", self.power_per_thrust, "W/N")

    @property
    def supply(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        """Largest command in either direction, N."""
        return jnp.maximum(self.thrust_forward_max, self.thrust_reverse_max)

    @property
    def dead_zone(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        """No dead zone: 0 N."""
        return jnp.zeros(())

    @property
    def linear_gain(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        """1 N of thrust per 1 N of command."""
        return jnp.ones(())

    def limits(self):
        return -self.thrust_reverse_max, self.thrust_forward_max

    def terminal(self, voltage) -> PerThruster:
        """The command itself, N."""
        return voltage

    def initial_state(self, count) -> LaggedThrust:
        return LaggedThrust(jnp.zeros(count))

    def dynamics(self, state, voltage) -> LaggedThrust:
        rate = (voltage - state.thrust) / self.time_constant
        return LaggedThrust(jnp.clip(rate, -self.thrust_rate_max, self.thrust_rate_max))

    def thrust(self, state, voltage) -> PerThruster:
        return state.thrust

    def current(self, state, voltage) -> PerThruster:
        """Zero: without a voltage only `electrical_power` is defined."""
        return jnp.zeros_like(state.thrust)

    def electrical_power(self, state, voltage) -> PerThruster:
        return self.power_per_thrust * jnp.abs(voltage)

    def speed_term(self, report):
        hint = "It is commanded in newtons and has no propeller speed. Preset `robust` models its lag"
        raise BadInput("speed_sensor", "be false with thruster commanded_thrust", "true", hint=hint)

    def actuator_model(self, count: int, measured: bool) -> LaggedActuator:
        return LaggedActuator(DirectActuator(self.linear_gain, *self.limits()), self.time_constant, count)

    def advice(self):
        if float(jnp.max(self.power_per_thrust)) > 0:
            return ()
        return ("the power of this thruster is not known: its energy counts as 0. Give `power_per_thrust`.",)


def commanded_thrust(
    thrust_forward_max: float = 51.4,
    thrust_reverse_max: float = 39.9,
    time_constant: float = 0.1,
    thrust_rate_max: float = math.inf,
    power_per_thrust: float = 7.6,
) -> CommandedThrust:
    """Thrust commanded in newtons, as by autopilots, with limits in each direction and a first-order lag.

    Default limits and power are those of the T200 at 16 V in the manufacturer's table: 51.4 N and -39.9 N, 389 W
    forward. The time constant is an assumption, as that of `first_order`.

    Args:
        thrust_forward_max: largest thrust forward, N.
        thrust_reverse_max: largest thrust in reverse, N; a positive number.
        time_constant: from a step of the command to 63 % of its thrust, s.
        thrust_rate_max: fastest change of thrust, N/s; infinite by default.
        power_per_thrust: electrical power per commanded newton in either direction, W/N; 0 where it is unknown.
    """
    return CommandedThrust(thrust_forward_max, thrust_reverse_max, time_constant, thrust_rate_max, power_per_thrust)  # pyright: ignore[reportArgumentType] - abstract fields are no arguments
