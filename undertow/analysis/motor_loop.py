"""Small-signal model of the controller with actuator dynamics: section 3.9 of the theory page.

Per axis, on x_ddot = a with a the acceleration that the actuators give when the law asks for a_c. The
identification model uses a_c (the applied voltage): no sensor measures propeller speeds. Masses cancel,
so what follows holds for any vehicle.

All of it is linear about fixed weights. Where these drift apart, d_hat = z - c eps with the gain c of section 3.8
(`drift.gain_of`), which damps the oscillation that the lag causes: the loop at the weights of one instant.
"""

from collections.abc import Callable

import numpy as np

from undertow.analysis.small_signal import Gains, gains
from undertow.control.controllers.composite_law import RCAF
from undertow.physics.thrusters.motor import DCMotor


def lag_matrix(law: RCAF, lag: float, gain: float = 1.0, axis: int = 0, drifted: float = 0.0) -> np.ndarray:
    """Closed loop (5 x 5) on (e, e_dot, eps, z, a) with a / a_c = gain / (lag p + 1), lag in s. Section 3.9.

    `drifted` is c of section 3.8, 1/s; where it is zero, z = d_hat.
    """
    return _closed(gains(law, axis), np.array([[-1 / lag]]), np.array([gain / lag]), np.array([1.0]), drifted)


def motor_matrix(
    law: RCAF, motor: DCMotor, speed: float, inductance: bool = True, axis: int = 0, drifted: float = 0.0
) -> np.ndarray:
    """Closed loop on (e, e_dot, eps, z, motor) about a propeller speed (rad/s). Eqs. (8)-(11), section 3.9.

    Args:
        law: the law.
        motor: constants, one motor.
        speed: propeller speed about which the thrust is linearised, rad/s.
        inductance: whether the winding counts; the motor's states are then its speed and current (6 x 6),
            else its speed alone (5 x 5).
        axis: which axis.
        drifted: c of section 3.8, 1/s; where it is zero, z = d_hat.
    """
    g = gains(law, axis)
    volts_per_thrust = 1 / float(motor.voltage_gain)
    thrust_slope = 2 * float(motor.thrust_coefficient) * abs(speed)
    torque_slope = 2 * float(motor.torque_coefficient) * abs(speed)
    if not inductance:
        resisted = float(motor.k2) + float(motor.k3) * torque_slope
        actuator = np.array([[-resisted]]) / float(motor.k1)
        return _closed(g, actuator, np.array([volts_per_thrust / float(motor.k1)]), np.array([thrust_slope]), drifted)
    inertia, winding = float(motor.rotor_inertia), float(motor.inductance)
    actuator = np.array(
        [
            [-(float(motor.friction) + torque_slope) / inertia, float(motor.torque_constant) / inertia],
            [-float(motor.back_emf_constant) / winding, -float(motor.resistance) / winding],
        ]
    )
    drive, push = np.array([0.0, volts_per_thrust / winding]), np.array([thrust_slope, 0.0])
    return _closed(g, actuator, drive, push, drifted)


def rightmost(matrix: np.ndarray) -> complex:
    """Eigenvalue of largest real part, 1/s, the one of a pair with positive imaginary part."""
    values = np.linalg.eigvals(matrix)
    value = complex(values[np.argmax(values.real)])
    return complex(value.real, abs(value.imag))


def stable_gains(matrix: Callable[[float], np.ndarray], largest: float) -> tuple[float, float] | None:
    """Smallest and largest gain c of section 3.8, of those from 0 to `largest` (1/s), with which a loop is stable.

    Args:
        matrix: the closed loop against c, of which it is an affine function: `lag_matrix` or `motor_matrix`.
        largest: 1/s, looked at in whole numbers.

    Returns:
        None if there is none: drifted weights cannot hold such a loop.
    """
    offset, slope = matrix(0.0), matrix(1.0) - matrix(0.0)
    values = np.arange(largest + 1)
    stable = values[np.linalg.eigvals(offset + values[:, None, None] * slope).real.max(1) < 0]
    return (float(stable[0]), float(stable[-1])) if stable.size else None


def _closed(g: Gains, actuator: np.ndarray, drive: np.ndarray, push: np.ndarray, drifted: float) -> np.ndarray:
    """Law around an actuator m' = actuator m + drive a_c, a = push m; d_hat = z - drifted eps."""
    # Rows and columns are e, e_dot, eps, z and m. `demanded` gives a_c from them, `delivered` the acceleration a.
    states = 4 + len(actuator)
    demanded = np.zeros(states)
    demanded[:4] = g.stiffness, g.damping, drifted, -1.0
    delivered = np.zeros(states)
    delivered[4:] = push
    matrix = np.zeros((states, states))
    matrix[0, 1] = 1.0
    matrix[1] = -delivered
    matrix[2] = demanded - delivered
    matrix[2, 2:4] += -g.pole - drifted, 1.0
    matrix[3, :3] = -g.adaptation * g.p12, -g.adaptation * g.p22, -g.b2
    matrix[4:, 4:] = actuator
    matrix[4:] += np.outer(drive, demanded)
    return matrix
