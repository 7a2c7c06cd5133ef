"""Fidelity level `electromechanical`: the full motor model, Eqs. (8)-(11)."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.param import Param, param
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.motor_speed_control import SpeedControlledMotor
from undertow.thrusters.thruster import AbstractThruster, PerThruster, Powers, PropellerReport


class ElectromechanicalState(NamedTuple):
    """Propeller speeds (rad/s) and winding currents (A)."""

    speed: PerThruster
    current: PerThruster


class ElectromechanicalThruster(AbstractThruster):
    """L I_dot + R I + k_e Om = V, J Om_dot + k_f Om + c_q Om|Om| = k_t I, T = c_t Om|Om|."""

    motor: DCMotor
    supply: Float[Param, ""] = param("V", "supply voltage", default=jnp.inf)
    dead_zone: Float[Param, ""] = param("V", "voltage below which the thrust is zero", default=0.0)
    dead_zone_kind: str = eqx.field(static=True, default="pass")
    has_prescribed_acceleration: bool = eqx.field(static=True, default=False)

    def initial_state(self, count) -> ElectromechanicalState:
        return ElectromechanicalState(jnp.zeros(count), jnp.zeros(count))

    def dynamics(self, state, voltage) -> ElectromechanicalState:
        motor = self.motor
        lost = motor.resistance * state.current + motor.back_emf_constant * state.speed
        current_rate = (self.terminal(voltage) - lost) / motor.inductance  # Eq. (9)
        return ElectromechanicalState(self._acceleration(state), current_rate)

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.thrust(state.speed)

    def current(self, state, voltage) -> PerThruster:
        return state.current

    def powers(self, state, voltage) -> Powers:
        return self.motor.powers(self.terminal(voltage), state.current, state.speed)

    def stored(self, state) -> PerThruster:
        return self.motor.inductance * state.current**2 / 2 + self.motor.rotor_energy(state.speed)

    def report(self, state) -> PropellerReport:
        return PropellerReport(state.speed, self._acceleration(state))

    def voltage_gain(self):
        return self.motor.voltage_gain

    def speed_term(self, report: PropellerReport) -> PerThruster:
        return self.motor.speed_term(report.speed, report.acceleration)  # pyright: ignore[reportArgumentType] - `report` gives it

    def actuator_model(self, count: int, measured: bool) -> SpeedControlledMotor:
        return SpeedControlledMotor(self, count, measured)

    def advice(self):
        return self.motor.advice()

    def _acceleration(self, state: ElectromechanicalState) -> PerThruster:
        motor = self.motor
        resisted = motor.friction * state.speed + motor.torque(state.speed)
        return (motor.torque_constant * state.current - resisted) / motor.rotor_inertia  # Eq. (8)
