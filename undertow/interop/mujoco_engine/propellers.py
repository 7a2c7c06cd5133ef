"""Thrusters in plain NumPy: the motor's two laws, voltage and torque, as they stand in any textbook."""

import numpy as np
from numpy.typing import NDArray

from undertow.core.errors import BadInput
from undertow.thrusters.shaft import ShaftThruster
from undertow.thrusters.static import StaticThruster
from undertow.thrusters.thruster import AbstractThruster


class Propellers:
    """N equal propellers on DC motors without inductance; `speed` (rad/s) is their state.

    Args:
        thruster: on fidelity `shaft` (rotor inertia) or `static` (always in the steady state).
        count: N.

    Raises:
        BadInput: another kind of thruster.
    """

    def __init__(self, thruster: AbstractThruster, count: int):
        if not isinstance(thruster, ShaftThruster | StaticThruster):
            hint = "Others are not written a second time; take fidelity: shaft"
            raise BadInput("thruster", "be on fidelity `shaft` or `static`", type(thruster).__name__, hint=hint)
        motor = thruster.motor
        self._resistance = np.asarray(motor.resistance)
        self._torque_constant = np.asarray(motor.torque_constant)
        self._back_emf = np.asarray(motor.back_emf_constant)
        self._friction = np.asarray(motor.friction)
        self._inertia = np.asarray(motor.rotor_inertia)
        self._thrust_coefficients = np.asarray(motor.thrust_coefficient), np.asarray(motor.reverse_thrust_coefficient)
        self._torque_coefficients = np.asarray(motor.torque_coefficient), np.asarray(motor.reverse_torque_coefficient)
        self._supply, self._dead_zone = float(thruster.supply), float(thruster.dead_zone)
        self._lost = self._dead_zone if thruster.dead_zone_kind == "subtract" else 0.0
        self._turns_at_once = isinstance(thruster, StaticThruster)
        self.speed = np.zeros(count)

    def admissible(self, voltage: NDArray) -> NDArray:
        """Voltage within the supply, V."""
        return np.clip(voltage, -self._supply, self._supply)

    def thrust(self) -> NDArray:
        """T = c_t speed|speed|, N."""
        return _either(self.speed, self._thrust_coefficients) * self.speed * np.abs(self.speed)

    def turn(self, voltage: NDArray, dt: float, samples: int) -> NDArray:
        """Hold a voltage (V) for dt (s).

        Returns:
            Thrust (N) at the ends of `samples` equal parts of dt, shape (samples + 1, N).
        """
        outside = voltage - self._lost * np.sign(voltage)
        terminal = np.where(np.abs(voltage) <= self._dead_zone, 0.0, outside)
        if self._turns_at_once:
            self.speed = self._steady(terminal)
            return np.tile(self.thrust(), (samples + 1, 1))
        thrusts = [self.thrust()]
        for _ in range(samples):
            self.speed = self._stepped(terminal, dt / samples)
            thrusts.append(self.thrust())
        return np.array(thrusts)

    def _speed_rate(self, voltage: NDArray, speed: NDArray) -> NDArray:
        """J speed_dot = k_t I - k_f speed - Q with R I = V - k_e speed."""
        current = (voltage - self._back_emf * speed) / self._resistance
        load = _either(speed, self._torque_coefficients) * speed * np.abs(speed)
        return (self._torque_constant * current - self._friction * speed - load) / self._inertia

    def _stepped(self, voltage: NDArray, h: float) -> NDArray:
        """Speed one classical Runge-Kutta step later."""
        a = self._speed_rate(voltage, self.speed)
        b = self._speed_rate(voltage, self.speed + h / 2 * a)
        c = self._speed_rate(voltage, self.speed + h / 2 * b)
        d = self._speed_rate(voltage, self.speed + h * c)
        return self.speed + h / 6 * (a + 2 * b + 2 * c + d)

    def _steady(self, voltage: NDArray) -> NDArray:
        """Speed at which torque and load balance: positive root of q x^2 + l x = k_t |V| / R, with the sign of V."""
        quadratic = _either(voltage, self._torque_coefficients)
        linear = self._friction + self._torque_constant * self._back_emf / self._resistance
        drive = self._torque_constant * np.abs(voltage) / self._resistance
        return np.sign(voltage) * (np.sqrt(linear**2 + 4 * quadratic * drive) - linear) / (2 * quadratic)


def _either(direction: NDArray, coefficients: tuple[NDArray, NDArray]) -> NDArray:
    """The forward or the reverse coefficient."""
    return np.where(direction < 0, coefficients[1], coefficients[0])
