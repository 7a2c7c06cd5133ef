"""Thrusters without dynamics: the voltage for a thrust is the inverse of the steady curve."""

import abc

import jax.numpy as jnp

from undertow.core.actuator_model import AbstractMemorylessActuator
from undertow.core.arrays import as_array, library_of, quotient
from undertow.physics.thrusters.thruster import AbstractThruster, PerThruster


class AbstractQuasiStaticThruster(AbstractThruster):
    """A thruster without a state: its thrust depends on the voltage alone."""

    has_prescribed_acceleration = True

    @abc.abstractmethod
    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        """V, V, that gives a thrust in N."""

    def initial_state(self, count):
        return jnp.zeros(0)

    def dynamics(self, state, voltage):
        return jnp.zeros(0)

    def stored(self, state) -> PerThruster:
        return jnp.zeros(())

    def report(self, state) -> None:
        return None

    def actuator_model(self, count: int, measured: bool) -> "QuasiStaticActuator":
        return QuasiStaticActuator(self)


class QuasiStaticActuator(AbstractMemorylessActuator):
    """Thrust without lag, by the thruster's own curve."""

    thruster: AbstractQuasiStaticThruster

    def time_constant(self):
        return jnp.zeros(())

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

    def dead_zone(self):
        share = quotient(self.thruster.dead_zone, self.thruster.supply)
        library = library_of(share)
        return as_array(library.max(library.asarray(share)))
