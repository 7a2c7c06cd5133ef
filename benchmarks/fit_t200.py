"""Where the numbers of `t200` and `t500` come from: python benchmarks/fit_t200.py [t200|t500]

One set of constants for the manufacturer's whole table, at every supply voltage, in steady state. The bench is taken
as duty = (PWM - 1500) / 400, V_motor = duty V_supply, I_motor = I_supply / |duty| (a lossless converter), and
k_t = k_e, as in any DC motor. Speed, current and thrust are fitted together, each in units of its own tolerance.

Friction is left out: the tables do not tell copper loss from shaft power. With friction and an offset in torque the
fit is no better, but the propeller would come out with a figure of merit of 0.95.
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

TABLES = Path(__file__).parents[1] / "tests" / "peers" / "data"
WATER, RADIUS = 1000.0, {"t200": 0.038}  # kg/m^3 and m, for the figure of merit
SETTINGS = {
    # dead zone (V), supply of the nominal point (V), tolerances of speed (rad/s), current (A) and thrust (N),
    # start of the search: k_e, R, c_q, c_t, c_t-, c_q-; without the last where c_q- = c_q will do
    "t200": (1.2, 16.0, (15.0, 0.8, 2.5), (0.02, 0.36, 4e-6, 3.7e-4, 3.0e-4)),
    "t500": (1.2, 24.0, (15.0, 1.0, 4.0), (0.04, 0.27, 2e-5, 1.5e-3, 1.0e-3, 2e-5)),
}
TIME_CONSTANT = 0.1  # s, about half of the full speed at the nominal supply: rotor inertias are not published


def main(name: str) -> dict:
    """Fit, and say how well it fits."""
    dead_zone, nominal, tolerances, start = SETTINGS[name]
    supply, pwm, *measured = np.loadtxt(TABLES / f"{name}_table.csv", delimiter=",", skiprows=1, unpack=True)
    duty = (pwm - 1500) / 400
    volts = np.where(np.abs(duty * supply) > dead_zone, duty * supply, 0.0)

    def misfit(scaled):
        speed, current, thrust = steady(volts, *(scaled * start))
        pairs = zip((speed, current * duty, thrust), measured, strict=True)
        return np.array([found - expected for found, expected in pairs])

    weighted = lambda scaled: (misfit(scaled) / np.array(tolerances)[:, None]).ravel()
    solution = least_squares(weighted, np.ones(len(start)), x_scale="jac").x
    back_emf, resistance, torque, *_ = constants = solution * start
    full_speed, _, _ = steady(np.array([nominal]), *constants)
    slope = back_emf + resistance / back_emf * torque * full_speed[0]  # dV/dOm at half of it
    found = dict(zip(("k_e", "R", "c_q", "c_t", "c_t_reverse", "c_q_reverse"), constants, strict=False))
    found["J"] = TIME_CONSTANT * slope * back_emf / resistance
    rms = np.sqrt((misfit(solution) ** 2).mean(1))
    found |= dict(zip(("rms_speed", "rms_current", "rms_thrust"), rms, strict=True))
    if name in RADIUS:
        strongest = np.argmax(measured[2])
        thrust, speed = measured[2][strongest], measured[0][strongest]
        ideal_power = thrust**1.5 / np.sqrt(2 * WATER * np.pi * RADIUS[name] ** 2)
        found["figure_of_merit"] = ideal_power / (torque * speed**3)
    return found


def steady(volts, back_emf, resistance, torque, thrust, thrust_reverse, torque_reverse=None):
    """Speed, current of the motor and thrust with R I + k_e Om = V, k_e I = c_q Om|Om|, T = c_t Om|Om|."""
    c_q = np.where(volts < 0, torque if torque_reverse is None else torque_reverse, torque)
    speed = 2 * volts / (back_emf + np.sqrt(back_emf**2 + 4 * resistance / back_emf * c_q * np.abs(volts)))
    square = speed * np.abs(speed)
    return speed, c_q * square / back_emf, np.where(volts < 0, thrust_reverse, thrust) * square


if __name__ == "__main__":
    found = main((sys.argv[1:] or ["t200"])[0])
    print(json.dumps({key: float(f"{value:.5g}") for key, value in found.items()}, indent=1))
