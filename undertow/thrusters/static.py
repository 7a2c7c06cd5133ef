"""Fidelity level `static`: the quasi-static motor, in its steady state at every instant."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.quasi_static_actuator import QuasiStaticActuator
from undertow.thrusters.thruster import AbstractThruster, PerThruster, Powers


class StaticThruster(AbstractThruster):
    """k_3 c_q Om|Om| + k_2 Om = V, T = c_t Om|Om|. The paper's Example 2, speed-sensorless."""

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
        return self.motor.thrust(self.motor.steady_speed(self.terminal(voltage)))

    def current(self, state, voltage) -> PerThruster:
        return self.motor.steady_current(self.motor.steady_speed(self.terminal(voltage)))

    def powers(self, state, voltage) -> Powers:
        volts = self.terminal(voltage)
        speed = self.motor.steady_speed(volts)
        return self.motor.powers(volts, self.motor.steady_current(speed), speed)

    def stored(self, state) -> PerThruster:
        return jnp.zeros(())

    def report(self, state) -> None:
        return None

    def voltage_gain(self):
        return self.motor.voltage_gain

    def speed_term(self, report):
        raise BadInput(
            "speed_sensor",
            "be false on fidelity `static`",
            "true",
            hint="There phi depends on the voltage being computed: Eq. (23) is an algebraic loop of gain 1",
        )

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        """V, V, that gives a thrust in N."""
        return self.commanded(self.motor.steady_voltage(self.motor.speed_at(thrust)))

    def actuator_model(self, count: int, measured: bool) -> QuasiStaticActuator:
        return QuasiStaticActuator(self)

    def advice(self):
        return self.motor.advice()
