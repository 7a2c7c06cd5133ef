"""Fidelity levels of a thruster with a DC motor: `shaft` and `electromechanical`, and the choice among all four."""

from typing import NamedTuple

import jax.numpy as jnp

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.motor_speed_control import SpeedControlledMotor
from undertow.physics.thrusters.motor_thruster import AbstractMotorThruster, IdealThruster, StaticThruster
from undertow.physics.thrusters.thruster import AbstractThruster, PerThruster, Powers, PropellerReport


class ShaftState(NamedTuple):
    """Propeller speeds, rad/s."""

    speed: PerThruster


class ShaftThruster(AbstractMotorThruster):
    """k_1 Om_dot + k_2 Om + k_3 Q = V: Eq. (14) with L = 0. The rotor has inertia, the winding no inductance."""

    def initial_state(self, count) -> ShaftState:
        return ShaftState(jnp.zeros(count))

    def dynamics(self, state, voltage) -> ShaftState:
        motor = self.motor
        return ShaftState((self.terminal(voltage) - motor.steady_voltage(state.speed)) * (1 / motor.k1))

    def thrust(self, state, voltage) -> PerThruster:
        return self.motor.thrust(state.speed)

    def current(self, state, voltage) -> PerThruster:
        motor = self.motor
        return (self.terminal(voltage) - motor.back_emf_constant * state.speed) * (1 / motor.resistance)

    def powers(self, state, voltage) -> Powers:
        return self.motor.powers(self.terminal(voltage), self.current(state, voltage), state.speed)

    def stored(self, state) -> PerThruster:
        return self.motor.rotor_energy(state.speed)

    def report(self, state) -> PropellerReport:
        """Speed only: its rate depends on the voltage that the controller computes from this report."""
        return PropellerReport(state.speed, None)

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


class ElectromechanicalState(NamedTuple):
    """Propeller speeds (rad/s) and winding currents (A)."""

    speed: PerThruster
    current: PerThruster


class ElectromechanicalThruster(AbstractMotorThruster):
    """L I_dot + R I + k_e Om = V, J Om_dot + k_f Om + c_q Om|Om| = k_t I, T = c_t Om|Om|: Eqs. (8)-(11)."""

    def initial_state(self, count) -> ElectromechanicalState:
        return ElectromechanicalState(jnp.zeros(count), jnp.zeros(count))

    def dynamics(self, state, voltage) -> ElectromechanicalState:
        motor = self.motor
        lost = motor.resistance * state.current + motor.back_emf_constant * state.speed
        current_rate = (self.terminal(voltage) - lost) * (1 / motor.inductance)  # Eq. (9)
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

    def speed_term(self, report: PropellerReport) -> PerThruster:
        return self.motor.speed_term(report.speed, report.acceleration)  # pyright: ignore[reportArgumentType] - `report` gives it

    def actuator_model(self, count: int, measured: bool) -> SpeedControlledMotor:
        return SpeedControlledMotor(self, count, measured)

    def _acceleration(self, state: ElectromechanicalState) -> PerThruster:
        motor = self.motor
        resisted = motor.friction * state.speed + motor.torque(state.speed)
        return (motor.torque_constant * state.current - resisted) * (1 / motor.rotor_inertia)  # Eq. (8)


FIDELITIES = {
    "ideal": IdealThruster,
    "static": StaticThruster,
    "shaft": ShaftThruster,
    "electromechanical": ElectromechanicalThruster,
}


def with_fidelity(
    motor: DCMotor, fidelity: str, supply: float = float(jnp.inf), dead_zone: float = 0.0, dead_zone_kind: str = "pass"
) -> AbstractThruster:
    """Thruster with a DC motor at a fidelity level.

    Args:
        motor: constants.
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; infinite by default.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.

    Raises:
        BadInput: unknown fidelity or kind, supply not positive, dead zone negative, or no inductance at
            `electromechanical`.
    """
    checks.choice("fidelity", fidelity, tuple(FIDELITIES))
    checks.positive("supply", supply, "V", finite=False)
    if fidelity == "electromechanical":
        checks.positive("inductance", motor.inductance, "H")
    return FIDELITIES[fidelity](motor=motor, supply=supply, dead_zone=dead_zone, dead_zone_kind=dead_zone_kind)
