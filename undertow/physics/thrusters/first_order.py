"""A thruster given by gain and time constant: thrust follows the voltage with a first-order lag."""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.actuator_model import LaggedActuator
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.thrusters.memoryless import MemorylessThruster
from undertow.physics.thrusters.quasi_static import QuasiStaticActuator
from undertow.physics.thrusters.thruster import AbstractMotorlessThruster, PerThruster

_OF_STEADY_STATE = (
    "thrust_per_volt",
    "power",
    "current_per_thrust",
    "linear_gain",
    "supply",
    "dead_zone",
    "dead_zone_kind",
    "reverse_share",
)


class LaggedThrust(NamedTuple):
    """Thrust of each thruster, N."""

    thrust: PerThruster


class FirstOrderThruster(AbstractMotorlessThruster):
    """tau T_dot + T = c |V|^(p-1) V, multiplied by `reverse_share` in reverse; without a motor model.

    Raises:
        BadInput: a coefficient is not positive.
    """

    thrust_per_volt: Float[Param, ""] = param("N/V^p", "steady thrust coefficient", symbol="c")
    power: Float[Param, ""] = param("", "power of the voltage", symbol="p")
    time_constant: Float[Param, ""] = param("s", "time to 63 % of a step of thrust", symbol="tau")
    reverse_share: Float[Param, ""] = param("", "thrust in reverse as a share of forward thrust")
    current_per_thrust: Float[Param, ""] = param("A/N", "current per steady thrust", symbol="c_I")
    linear_gain: Float[Param, ""] = param("N/V", "gain that preset `paper` assumes", symbol="alpha")
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")

    def __check_init__(self):
        checks.positive("time_constant", self.time_constant, "s")
        self.settled()

    def settled(self) -> MemorylessThruster:
        """The same thruster without its lag."""
        return MemorylessThruster(**{name: getattr(self, name) for name in _OF_STEADY_STATE})

    def steady_thrust(self, voltage: PerThruster) -> PerThruster:
        """Steady thrust, N, of a voltage in V."""
        return self.settled().thrust((), voltage)

    def initial_state(self, count) -> LaggedThrust:
        return LaggedThrust(jnp.zeros(count))

    def dynamics(self, state, voltage) -> LaggedThrust:
        return LaggedThrust((self.steady_thrust(voltage) - state.thrust) / self.time_constant)

    def thrust(self, state, voltage) -> PerThruster:
        return state.thrust

    def current(self, state, voltage) -> PerThruster:
        """Current of the steady state, A. It leads the thrust, so that a thruster being reversed returns no power."""
        return self.current_per_thrust * self.steady_thrust(voltage)

    def speed_term(self, report):
        hint = "This thruster has no propeller speed. Describe its motor (DCMotor); preset `robust` models its lag"
        raise BadInput("speed_sensor", "be false with thruster first_order", "true", hint=hint)

    def actuator_model(self, count: int, measured: bool) -> LaggedActuator:
        return LaggedActuator(QuasiStaticActuator(self.settled()), self.time_constant, count)

    def advice(self):
        return ()


def first_order(
    thrust_per_volt: float = 10.9,
    time_constant: float = 0.1,
    power: float = 1.0,
    reverse_share: float = 1.0,
    current_per_thrust: float = 0.072,
    linear_gain: float | None = None,
    supply: float = math.inf,
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
) -> FirstOrderThruster:
    """Thrust that follows T = c V (or c V|V|) with a first-order lag, where no more is known of a thruster.

    For limits in newtons, which may differ forward and in reverse, take `commanded_thrust`.

    Default gain and current are those of the paper's motor at 10 V; the time constant is an assumption, as for most
    thrusters: published ones of small vehicles range from 0.05 s (RexROV, LAUV) to 0.2 s.

    Args:
        thrust_per_volt: c, N/V, or N/V^2 with power 2.
        time_constant: from a step of voltage to 63 % of its thrust, s.
        power: of the voltage in the steady thrust; 1 linear, 2 quadratic.
        reverse_share: thrust in reverse as a share of forward thrust at the same voltage.
        current_per_thrust: c_I, A/N, in steady state.
        linear_gain: alpha that preset `paper` assumes, N/V; None for thrust_per_volt, when power is 1.
        supply: voltage limit, V.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.

    Raises:
        BadInput: a value that is not positive, or no linear_gain for a thrust that is not linear.
    """
    if linear_gain is None:
        if power != 1:
            hint = (
                f"The model is T = alpha V: give the slope that fits the voltages in use, {thrust_per_volt:g} V^(p-1)"
            )
            raise BadInput("linear_gain", "be given when `power` is not 1", hint=hint)
        linear_gain = thrust_per_volt
    known = (thrust_per_volt, power, time_constant, reverse_share, current_per_thrust, linear_gain)
    return FirstOrderThruster(*known, supply, dead_zone, dead_zone_kind)  # pyright: ignore[reportArgumentType] - abstract fields are no arguments
