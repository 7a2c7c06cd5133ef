"""Speed control of motors by computed voltage, so that a thruster follows a commanded thrust."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.numerics.integrators import rk4
from undertow.physics.thrusters.motor_thruster import AbstractMotorThruster, StaticThruster
from undertow.physics.thrusters.quasi_static import QuasiStaticActuator
from undertow.physics.thrusters.thruster import PerThruster

# Bandwidth of the current loop relative to that of the speed loop.
_CURRENT_FASTER = 3.0

# Where the winding is slow, the current needs a sampled loop of its own, which leaves this share of the rate.
_DRIVEN = 0.43


class MotorState(NamedTuple):
    """Estimate of the motors' state by the controller."""

    speed: PerThruster  # rad/s
    current: PerThruster  # A


class SpeedControlledMotor(AbstractActuatorModel):
    """Current for a required torque, Eq. (8), and voltage for that current, Eq. (9). Section X9 of the theory.

    Speeds are those reported where they are measured, else predicted by the same equations from the applied voltages;
    currents are predicted.
    """

    thruster: AbstractMotorThruster
    count: int = eqx.field(static=True)
    measured: bool = eqx.field(static=True)

    def max_bandwidth(self, sampled):
        motor = self.thruster.motor
        winding = jnp.min(motor.resistance / jnp.maximum(motor.inductance, 1e-12))
        driven = jnp.where(winding > _CURRENT_FASTER * sampled, 1.0, _DRIVEN) * sampled
        return jnp.maximum(driven, 1 / jnp.max(self.time_constant()))  # its own bandwidth costs no extra voltage

    def time_constant(self):
        """k_1 / (k_2 + 2 k_3 c_q |Om|) at half of the largest speed; at rest, where it is largest, without a limit."""
        motor, supply = self.thruster.motor, jnp.asarray(self.thruster.supply)
        limited = jnp.isfinite(supply)
        fastest = motor.steady_speed(jnp.where(limited, supply, 0.0))
        return motor.k1 / (motor.k2 + motor.k3 * motor.torque_coefficient * jnp.abs(fastest))

    def init(self) -> MotorState:
        return MotorState(jnp.zeros(self.count), jnp.zeros(self.count))

    def update_from_report(self, state: MotorState, report) -> MotorState:
        return state._replace(speed=report.speed) if self.measured else state

    def range(self, state: MotorState, rate) -> tuple[PerThruster, PerThruster]:
        """Thrusts, N, that -supply and supply allow at `rate`."""
        motor = self.thruster.motor
        resisted = motor.steady_voltage(state.speed)
        limited = jnp.isfinite(self.thruster.supply)
        volts = self.thruster.terminal(
            jnp.where(limited, self.thruster.supply, 0.0)
        )  # so that an infinite supply has gradients, too
        low, high = (state.speed + (side * volts - resisted) * (1 / (motor.k1 * rate)) for side in (-1, 1))
        return jnp.where(limited, motor.thrust(low), -jnp.inf), jnp.where(limited, motor.thrust(high), jnp.inf)

    def force(self, state: MotorState, u) -> PerThruster:
        return self.thruster.motor.thrust(state.speed)

    def command(self, state: MotorState, force, rate) -> PerThruster:
        motor = self.thruster.motor
        pull = motor.rotor_inertia * rate * (motor.speed_at(force) - state.speed)
        current = motor.steady_current(state.speed) + pull * (1 / motor.torque_constant)
        held = motor.resistance * current + motor.back_emf_constant * state.speed
        return self.thruster.commanded(held + self._boost(rate) * (current - state.current))

    def target_of(self, state: MotorState, u, rate) -> PerThruster:
        motor, boost = self.thruster.motor, self._boost(rate)
        free = self.thruster.terminal(u) - motor.back_emf_constant * state.speed + boost * state.current
        pull = (free * (1 / (motor.resistance + boost)) - motor.steady_current(state.speed)) * motor.torque_constant
        return motor.thrust(state.speed + pull * (1 / (motor.rotor_inertia * rate)))

    def advance(self, state: MotorState, u, dt) -> MotorState:
        """Exact current for a constant back-EMF at any winding time constant; speed from the mean current."""
        motor = self.thruster.motor
        settled = (self.thruster.terminal(u) - motor.back_emf_constant * state.speed) * (1 / motor.resistance)
        fading = motor.resistance * dt / jnp.maximum(motor.inductance, 1e-12)
        mean = settled + (state.current - settled) * (-jnp.expm1(-fading) / fading)
        pull = lambda speed: motor.torque_constant * (mean - motor.steady_current(speed))
        turning = lambda t, speed: pull(speed) * (1 / motor.rotor_inertia)
        speed = rk4(turning, jnp.zeros(()), state.speed, dt)
        return MotorState(speed, settled + (state.current - settled) * jnp.exp(-fading))

    def dead_zone(self):
        return self.quasi_static().dead_zone()

    def quasi_static(self) -> QuasiStaticActuator:
        names = ("motor", "supply", "dead_zone", "dead_zone_kind")
        return QuasiStaticActuator(StaticThruster(**{name: getattr(self.thruster, name) for name in names}))

    def _boost(self, rate) -> PerThruster:
        """Gain of the current loop, ohm: positive where the winding's own rate R / L is too slow."""
        return jnp.maximum(
            self.thruster.motor.inductance * _CURRENT_FASTER * rate - self.thruster.motor.resistance, 0.0
        )
