"""Control KTH's BlueROV2 Heavy, a simulator by other people, with the controller of undertow.

    curl -LO https://raw.githubusercontent.com/ViktorNfa/bluerov2_dynamics/main/fossen/BlueROV2.py
    python examples/kth_bluerov2.py BlueROV2.py

Their class is used as it is; `simulate` is all there is between the two. The controller knows the same published
numbers (von Benzon et al. 2022, Table A1, which undertow has as `bluerov2_heavy`), and of the thrusters only that their
thrust lags.
"""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np

import undertow as ut

CURRENT = np.array([0.3, 0.2, 0.0])  # of the water, m/s, north, east, down; the controller does not know it
TARGET = np.array([2.0, 1.0, 1.5, 0.0, 0.0, 0.5])  # north, east, down, m; roll, pitch, yaw, rad
SCENARIO = {
    "plant": {
        "vehicle": {"kind": "bluerov2_heavy", "parameters": "vonbenzon2022"},
        # Their polynomial rises to 30.6 N; their lag (6136 s + 108700)/(s^3 + 89 s^2 + 9258 s + 108700) is 29 ms long.
        "thruster": {
            "kind": "commanded_thrust",
            "thrust_forward_max": 30.6,
            "thrust_reverse_max": 30.6,
            "time_constant": 0.029,
        },
    },
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": TARGET.tolist()},
    "loop": {"dt": 0.02, "duration": 30.0, "record": 0.02},
}


def simulate(rov: Any, autopilot: ut.Autopilot, seconds: float) -> np.ndarray:
    """States (position, angles, u v w p q r) at every control step, shape (K, 12), from rest at zero."""
    for lag in rov.thruster_lags:  # NumPy 2.4 makes no number of an array with one entry
        lag._Cc = np.ravel(lag._Cc)
    volts = np.linspace(-0.97, 0.97, 1941)  # normalised; beyond, their polynomial falls
    newtons, states, h = rov._old_thruster_force_from_input(volts), [np.zeros(12)], autopilot.sampling_time / 10
    thrust = autopilot.start(states[0][:3], states[0][6:], states[0][3:6], target=TARGET)
    for _ in range(round(seconds / autopilot.sampling_time)):
        x, u = states[-1], np.interp(thrust, newtons, volts)
        for _ in range(10):  # Euler: `dynamics` moves its thruster lag on by h at every call
            x = x + h * rov.dynamics(x, u, h)
        states.append(x)
        thrust = autopilot.step(x[:3], x[6:], x[3:6], target=TARGET)
    return np.array(states)


def simulator(path: str | Path) -> Any:
    """An object of the class in KTH's file."""
    spec = importlib.util.spec_from_file_location("kth_bluerov2_dynamics", path)
    if spec is None or spec.loader is None or not Path(path).is_file():
        raise SystemExit(f"{path} is not a Python file. The head of this script says where to get BlueROV2.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.BlueROV2()


def main(rov: Any, seconds: float = 30.0) -> tuple[float, float]:
    """Print and return the errors of the last 5 s: largest distance (m) and largest error of an angle (rad)."""
    rov.current_speed = CURRENT
    states = simulate(rov, ut.Autopilot(SCENARIO), seconds)
    late = states[-round(5.0 / SCENARIO["loop"]["dt"]) :, :6] - TARGET
    distance, angle = np.linalg.norm(late[:, :3], axis=1).max(), np.abs(late[:, 3:]).max()
    print(
        f"last 5 of {seconds:g} s: at most {1e3 * distance:.2g} mm and {np.degrees(angle):.2g} deg from the set-point"
    )
    return float(distance), float(angle)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(simulator(sys.argv[1]))
