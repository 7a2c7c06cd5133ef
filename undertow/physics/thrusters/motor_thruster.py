"""A thruster with a DC motor, and its fidelity levels without dynamics: `ideal` and `static`."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.quasi_static import AbstractQuasiStaticThruster
from undertow.physics.thrusters.thruster import AbstractThruster, PerThruster, Powers


class AbstractMotorThruster(AbstractThruster):
    """A thruster with a DC motor."""

    motor: DCMotor
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")

    def voltage_gain(self):
        return self.motor.voltage_gain

    def advice(self):
        supply, tested = float(np.asarray(self.supply).max()), self.motor.tested_voltage
        beyond = (
            f"`supply` is {supply:g} V, but the data of this thruster end at {tested:g} V: thrust and current beyond "
            "are extrapolated",
        )
        return self.motor.advice() + (beyond if supply > tested else ())


class IdealThruster(AbstractMotorThruster, AbstractQuasiStaticThruster):
    """T = alpha V: Eq. (15) once a perfect speed sensor has cancelled phi. The paper's Example 1."""

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

    def speed_term(self, report):
        return jnp.zeros(())

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        return self.commanded(self.motor.ideal_voltage(thrust))


class StaticThruster(AbstractMotorThruster, AbstractQuasiStaticThruster):
    """k_3 c_q Om|Om| + k_2 Om = V, T = c_t Om|Om|: steady at every instant. The paper's Example 2, speed-sensorless."""

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.thrust(self.motor.steady_speed(self.terminal(voltage)))

    def current(self, state, voltage) -> PerThruster:
        return self.motor.steady_current(self.motor.steady_speed(self.terminal(voltage)))

    def powers(self, state, voltage) -> Powers:
        volts = self.terminal(voltage)
        speed = self.motor.steady_speed(volts)
        return self.motor.powers(volts, self.motor.steady_current(speed), speed)

    def speed_term(self, report):
        raise BadInput(
            "speed_sensor",
            "be false on fidelity `static`",
            "true",
            hint="There phi depends on the voltage being computed: Eq. (23) is an algebraic loop of gain 1",
        )

    def voltage_for(self, thrust: PerThruster) -> PerThruster:
        return self.commanded(self.motor.steady_voltage(self.motor.speed_at(thrust)))
