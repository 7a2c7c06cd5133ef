"""Fidelity level `ideal`: thrust proportional to voltage."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.param import Param, param
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.quasi_static_actuator import QuasiStaticActuator
from undertow.thrusters.thruster import AbstractThruster, PerThruster, Powers


class IdealThruster(AbstractThruster):
    """T = alpha V: Eq. (15) once a perfect speed sensor has cancelled phi. The paper's Example 1."""

    motor: DCMotor
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")
    has_prescribed_acceleration: bool = eqx.field(static=True, default=True)

    def initial_state(self, count):
        return jnp.zeros(0)

    def dynamics(self, state, voltage):
        return jnp.zeros(0)

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.ideal_thrust(self.terminal(voltage))

    def current(self, state, voltage) -> PerThruster:
        return self.motor.steady_current(self.motor.speed_at(self.thrust(state, voltage)))

    def powers(self, state, voltage) -> Powers:
        """Powers of the motor at its steady current; the part of R I + k_e Om above V is created energy, too."""
        motor, volts = self.motor, self.terminal(voltage)
        speed = motor.speed_at(self.thrust(state, voltage))
        current = motor.steady_current(speed)
        powers = motor.powers(volts, current, speed)
        lacking = motor.resistance * current + motor.back_emf_constant * speed - volts
        return powers._replace(conversion=powers.conversion + lacking * current)

    def stored(self, state) -> PerThruster:
        return jnp.zeros(())

    def report(self, state) -> None:
        return None

    def voltage_gain(self):
        return self.motor.voltage_gain

    def speed_term(self, report):
        return jnp.zeros(())

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        """V, V, that gives a thrust in N."""
        return self.commanded(self.motor.ideal_voltage(thrust))

    def actuator_model(self, count: int, measured: bool) -> QuasiStaticActuator:
        return QuasiStaticActuator(self)

    def advice(self):
        return self.motor.advice()
