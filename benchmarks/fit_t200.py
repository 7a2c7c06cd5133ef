"""Fit of the parameters of `t200` and `t500`: python benchmarks/fit_t200.py [t200|t500] [pass|subtract] [TABLE]

One set of constants for the manufacturer's whole table, at every supply voltage, in steady state. The test bench has
duty = (PWM - 1500) / 400, V = duty V_supply, less the dead zone, and k_t = k_e, as in any DC motor. Outside the dead
zone the motor gets V (`pass`) or its part beyond the zone (`subtract`); the converter loses no power, so that
I_supply = I_motor V_motor / V_supply. Speed, current and thrust are fitted together, each in units of its own
tolerance. TABLE is a CSV file with columns as in tests/peers/data, which is the default.

Friction is neglected, because the tables do not separate copper loss from shaft power. With friction and an offset in
torque the fit is no better, but the propeller would have a figure of merit of 0.95.
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
    # start of the search: k_e, R, c_q, c_t, c_t-, c_q-; without the last where c_q- = c_q
    "t200": (1.2, 16.0, (15.0, 0.8, 2.5), (0.02, 0.36, 4e-6, 3.7e-4, 3.0e-4)),
    "t500": (1.2, 24.0, (15.0, 1.0, 4.0), (0.04, 0.27, 2e-5, 1.5e-3, 1.0e-3, 2e-5)),
}
TIME_CONSTANT = 0.1  # s, about half of the full speed at the nominal supply: rotor inertias are not published
SMALL = 4.0  # V: up to here thrusts are those of station keeping in still water


def main(name: str, kind: str = "pass", table: str | None = None) -> dict:
    """Parameters, and errors of the fit."""
    dead_zone, nominal, tolerances, start = SETTINGS[name]
    path = table or TABLES / f"{name}_table.csv"
    supply, pwm, *measured = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    command = (pwm - 1500) / 400 * supply
    volts = outside(command, dead_zone, kind)

    def misfit(scaled):
        speed, current, thrust = steady(volts, *(scaled * start))
        pairs = zip((speed, current * volts / supply, thrust), measured, strict=True)
        return np.array([found - expected for found, expected in pairs])

    weighted = lambda scaled: (misfit(scaled) / np.array(tolerances)[:, None]).ravel()
    # Every constant stays positive.
    fit = least_squares(weighted, np.ones(len(start)), x_scale="jac", bounds=(1e-3, np.inf))
    back_emf, resistance, torque, *_ = constants = fit.x * start
    full_speed, _, _ = steady(outside(np.array([nominal]), dead_zone, kind), *constants)
    slope = back_emf + resistance / back_emf * torque * full_speed[0]  # dV/dOm at half of it
    found = dict(zip(("k_e", "R", "c_q", "c_t", "c_t_reverse", "c_q_reverse"), constants, strict=False))
    found["J"] = TIME_CONSTANT * slope * back_emf / resistance
    errors, small = misfit(fit.x), np.abs(command) <= SMALL
    for suffix, rows in (("", ...), (f"_up_to_{SMALL:g}_V", small)):
        rms = np.sqrt((errors[:, rows] ** 2).mean(1))
        found |= {f"rms_{what}{suffix}": of for what, of in zip(("speed", "current", "thrust"), rms, strict=True)}
    found["cost"] = fit.cost
    if name in RADIUS:
        strongest = np.argmax(measured[2])
        thrust, speed = measured[2][strongest], measured[0][strongest]
        ideal_power = thrust**1.5 / np.sqrt(2 * WATER * np.pi * RADIUS[name] ** 2)
        found["figure_of_merit"] = ideal_power / (torque * speed**3)
    return found


def outside(command, dead_zone, kind):
    """Voltage of the motor, V."""
    if kind == "subtract":
        return np.sign(command) * np.maximum(np.abs(command) - dead_zone, 0.0)
    return np.where(np.abs(command) > dead_zone, command, 0.0)


def steady(volts, back_emf, resistance, torque, thrust, thrust_reverse, torque_reverse=None):
    """Speed, current of the motor and thrust with R I + k_e Om = V, k_e I = c_q Om|Om|, T = c_t Om|Om|."""
    c_q = np.where(volts < 0, torque if torque_reverse is None else torque_reverse, torque)
    speed = 2 * volts / (back_emf + np.sqrt(back_emf**2 + 4 * resistance / back_emf * c_q * np.abs(volts)))
    square = speed * np.abs(speed)
    return speed, c_q * square / back_emf, np.where(volts < 0, thrust_reverse, thrust) * square


if __name__ == "__main__":
    found = main(*(sys.argv[1:] or ["t200"]))
    print(json.dumps({key: float(f"{value:.5g}") for key, value in found.items()}, indent=1))
