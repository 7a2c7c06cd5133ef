"""Fidelity level `shaft`: the rotor has inertia, the winding no inductance."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.motor_speed_control import SpeedControlledMotor
from undertow.thrusters.thruster import AbstractThruster, PerThruster, Powers, PropellerReport


class ShaftState(NamedTuple):
    """Propeller speeds, rad/s."""

    speed: PerThruster


class ShaftThruster(AbstractThruster):
    """k_1 Om_dot + k_2 Om + k_3 Q = V: Eq. (14) with L = 0."""

    motor: DCMotor
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")
    has_prescribed_acceleration: bool = eqx.field(static=True, default=False)

    def initial_state(self, count) -> ShaftState:
        return ShaftState(jnp.zeros(count))

    def dynamics(self, state, voltage) -> ShaftState:
        motor = self.motor
        return ShaftState((self.terminal(voltage) - motor.steady_voltage(state.speed)) / motor.k1)

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.thrust(state.speed)

    def current(self, state, voltage) -> PerThruster:
        motor = self.motor
        return (self.terminal(voltage) - motor.back_emf_constant * state.speed) / motor.resistance

    def powers(self, state, voltage) -> Powers:
        return self.motor.powers(self.terminal(voltage), self.current(state, voltage), state.speed)

    def stored(self, state) -> PerThruster:
        return self.motor.rotor_energy(state.speed)

    def report(self, state) -> PropellerReport:
        """Speed only: its rate depends on the voltage that the controller computes from this report."""
        return PropellerReport(state.speed, None)

    def voltage_gain(self):
        return self.motor.voltage_gain

    def speed_term(self, report):
        raise BadInput(
            "speed_sensor",
            "be false on fidelity `shaft`",
            "true",
            hint="There Om_dot depends on the voltage being computed: Eq. (23) is an algebraic loop of gain 1. "
            "Use preset: robust, which needs the speed only, or fidelity: electromechanical, where states give Om_dot",
        )

    def actuator_model(self, count: int, measured: bool) -> SpeedControlledMotor:
        return SpeedControlledMotor(self, count, measured)

    def advice(self):
        return self.motor.advice()
