"""Rung `ideal`: thrust proportional to voltage."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.param import param
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.thruster import AbstractThruster, PerThruster


class IdealThruster(AbstractThruster):
    """T = alpha V: Eq. (15) once a perfect speed sensor has cancelled phi. The paper's Example 1."""

    motor: DCMotor
    supply: Float[Array, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Array, ""] = param("V", "voltage below which nothing turns", default=0.0)
    has_prescribed_acceleration: bool = eqx.field(static=True, default=True)

    def initial_state(self, count):
        return jnp.zeros(0)

    def dynamics(self, state, voltage):
        return jnp.zeros(0)

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.voltage_gain * self.terminal(voltage)

    def current(self, state, voltage) -> PerThruster:
        thrust = self.thrust(state, voltage)
        speed = jnp.sign(thrust) * jnp.sqrt(jnp.abs(thrust) / self.motor.thrust_coefficient)
        return self.motor.steady_current(speed)

    def report(self, state) -> None:
        return None

    def voltage_gain(self):
        return self.motor.voltage_gain

    def speed_term(self, report):
        return jnp.zeros(())

    def advice(self):
        return self.motor.advice()
