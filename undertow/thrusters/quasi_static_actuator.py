"""Thrusters without dynamics: the voltage for a thrust is the inverse of the steady curve."""

from typing import Protocol, runtime_checkable

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.param import Param
from undertow.thrusters.thruster import PerThruster


@runtime_checkable
class Invertible(Protocol):
    """A thruster whose thrust depends on the voltage alone."""

    supply: Float[Param, "..."]

    def thrust(self, state, voltage: PerThruster) -> PerThruster:
        """T, N."""
        ...

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        """V, V."""
        ...


class QuasiStaticActuator(AbstractActuatorModel):
    """Thrust without lag, by the thruster's own curve."""

    thruster: Invertible

    def max_bandwidth(self, sampled):
        return sampled

    def time_constant(self):
        return jnp.zeros(())

    def init(self) -> tuple[()]:
        return ()

    def update_from_report(self, state, report) -> tuple[()]:
        return ()

    def range(self, state, rate) -> tuple[PerThruster, PerThruster]:
        top = jnp.asarray(self.thruster.supply)
        limited = jnp.isfinite(top)
        volts = jnp.where(limited, top, 0.0)  # the curve of a motor is inf / inf at infinite voltage
        low, high = self.thruster.thrust((), -volts), self.thruster.thrust((), volts)
        return jnp.where(limited, low, -jnp.inf), jnp.where(limited, high, jnp.inf)

    def force(self, state, u) -> PerThruster:
        return self.thruster.thrust((), u)

    def command(self, state, force, rate) -> PerThruster:
        return self.thruster.voltage_for(force)

    def target_of(self, state, u, rate) -> PerThruster:
        return self.thruster.thrust((), u)

    def advance(self, state, u, dt) -> tuple[()]:
        return ()

    def quasi_static(self) -> "QuasiStaticActuator":
        return self
