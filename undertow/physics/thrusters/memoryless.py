"""The static thruster models that the paper's Fig. 2 criticises: T = c_0 V, T = c_V V|V|, I = c_I T."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.thrusters.quasi_static import AbstractQuasiStaticThruster
from undertow.physics.thrusters.thruster import PerThruster

_LEAST = 1e-30  # stands for 0, where a power has no slope


class MemorylessThruster(AbstractQuasiStaticThruster):
    """Thrust c |V|^(p-1) V, multiplied by `reverse_share` in reverse; current proportional to thrust.

    Raises:
        BadInput: a coefficient is not positive.
    """

    thrust_per_volt: Float[Param, ""] = param("N/V^p", "thrust coefficient", symbol="c_0, c_V")
    power: Float[Param, ""] = param("", "power of the voltage", symbol="p")
    current_per_thrust: Float[Param, ""] = param("A/N", "current coefficient", symbol="c_I")
    linear_gain: Float[Param, ""] = param("N/V", "gain in the nominal model", symbol="alpha")
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")
    reverse_share: Float[Param, ""] = param("", "thrust in reverse as a share of forward thrust", default=1.0)

    def __check_init__(self):
        for name in ("thrust_per_volt", "power", "current_per_thrust", "linear_gain", "reverse_share"):
            checks.positive(name, getattr(self, name))
        checks.positive("supply", self.supply, "V", finite=False)

    def thrust(self, state, voltage) -> PerThruster:
        volts = self.terminal(voltage)
        return self._coefficient(volts) * _signed_power(volts, self.power)

    def current(self, state, voltage) -> PerThruster:
        return self.current_per_thrust * self.thrust(state, voltage)

    def powers(self, state, voltage) -> None:
        return None

    def voltage_gain(self):
        return self.linear_gain

    def speed_term(self, report):
        raise BadInput("speed_sensor", "be false", "true", hint="This thruster has no propeller speed")

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        return self.commanded(_signed_power(thrust / self._coefficient(thrust), 1 / self.power))

    def advice(self):
        return ()

    def _coefficient(self, direction: PerThruster) -> PerThruster:
        return jnp.where(direction < 0, self.reverse_share, 1.0) * self.thrust_per_volt


def _signed_power(x: PerThruster, power: PerThruster) -> PerThruster:
    """|x|^(p-1) x with a finite slope at 0: 1 where p is 1."""
    size = jnp.abs(x)
    return x * jnp.where(size > 0, size, _LEAST) ** (power - 1)
