"""The numbers of other people's simulator, found by `undertow identify` from a dive in it.

    curl -LO https://raw.githubusercontent.com/ViktorNfa/bluerov2_dynamics/main/fossen/BlueROV2.py
    python benchmarks/kth_identification.py BlueROV2.py

KTH's BlueROV2 Heavy dives for five minutes by the thrusts of `Excitation`, through the function `simulate` of
examples/kth_bluerov2.py. The log has the commanded thrusts and readings with noise. Masses, damping, buoyancy and lag
begin 30 % off, and linear damping that is 0 begins at 30 % of the quadratic one. What the file says is read from its
object. Signs and frames are those of undertow, as tests/peers/test_kth_bluerov2.py shows: z down, damping and added
mass as negative derivatives. There is no current.

Taken as known: mass, inertia, and where the thrusters are (KTH turns them by angles with
two decimals, so that four are up to 1 mm beside the mirror images). Three things differ from the model of undertow:

* Thrust follows its command by (6136 s + 108700)/(s^3 + 89 s^2 + 9258 s + 108700), and the model has one pole. The
  table compares mean delays, which are what slow inputs see. Its slowest pole has a time constant of 76 ms, and some
  5 ms of the mean delay come later than 0.1 s after a jump. The estimate from inputs that jump is shorter than the
  mean delay, and its interval misses it. `--one-pole` replaces the lag by one of first order with the same delay.
* Euler's method with steps of 2 ms takes the thrust at the end of each step, which is 1 ms early on average.
* It also makes a damped motion faster: a rate of decay of a per second becomes a + 0.001 s a^2, 1 % at 10 per second.
"""

import argparse
import importlib.util
import time
from pathlib import Path
from typing import Any

import numpy as np

import undertow as ut
from undertow.core.measurement import BODY_AXES
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.studies.identification.simulated_dive import SENSORS, telegraph_wrenches

EXAMPLE = Path(__file__).parents[1] / "examples" / "kth_bluerov2.py"
OFF = 0.3  # share by which the prior is off
STEP = 0.02  # s, of their control steps and of the identification: lags are short
LARGEST = 30.0  # N, of their thrusters, about
LARGEST_WRENCH = np.array([25.0, 25.0, 25.0, 1.0, 1.0, 2.5])  # N, N m; roll and pitch stay below a right angle
# Weak feedback that keeps the vehicle upright and near its place: N/m, N m/rad. It has no damping.
STIFFNESS = np.array([4.0, 4.0, 4.0, 2.0, 2.0, 0.5])
DAMPING_NAMES = (("Xu", "Yv", "Zw", "Kp", "Mq", "Nr"), ("Xu_abs", "Yv_abs", "Zw_abs", "Kp_abs", "Mq_abs", "Nr_abs"))
SIGNALS = {
    "position": (slice(0, 3), ("north", "east", "down"), "m"),
    "attitude": (slice(3, 6), ("roll", "pitch", "yaw"), "rad"),
    "body_velocity": (slice(6, 9), ("surge", "sway", "heave"), "m/s"),
    "angular_velocity": (slice(9, 12), ("p", "q", "r"), "rad/s"),
}


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser()
    options.add_argument("file", type=Path)
    options.add_argument("--duration", type=float, default=300.0, help="s")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--one-pole", action="store_true", help="replace the lag of their thrusters")
    arguments = options.parse_args()
    kth = _example()
    rov, second_rov = (kth.simulator(arguments.file) for _ in range(2))
    if arguments.one_pole:
        for lag in (*rov.thruster_lags, *second_rov.thruster_lags):
            replace_by_one_pole(lag)
    truth = numbers_of(rov)
    generator = np.random.default_rng(arguments.seed)
    dive = dive_log(kth, rov, generator, arguments.duration, "dive")
    second = dive_log(kth, second_rov, generator, 60.0, "second dive")
    scenario = prior_scenario(kth, rov, truth, generator)
    started = time.perf_counter()
    model = ut.identify(scenario, dive, unseen=[second], step=STEP)
    print(f"identified in {time.perf_counter() - started:.0f} s, converged {model.result.estimate.converged}")
    for finding in model.result.findings:
        print(finding)
    print_intervals(model, truth, scenario["plant"]["thruster"]["time_constant"])
    print_fits(model)


class Excitation:
    """Takes the place of an autopilot in `simulate` of the example: thrusts that jump at random, and weak feedback.

    Args:
        generator: of random numbers.
        matrix: of the thrusters, (6, 8).
        duration: s.
    """

    sampling_time = STEP

    def __init__(self, generator: np.random.Generator, matrix: np.ndarray, duration: float):
        self._inverse = np.linalg.pinv(matrix)
        jumps = telegraph_wrenches(generator, duration + STEP, LARGEST_WRENCH)  # every 0.01 s
        self._wrenches = jumps[:: round(STEP / 0.01)]
        self.thrusts: list[np.ndarray] = []

    def start(self, position: np.ndarray, velocity: np.ndarray, angles: np.ndarray, target: Any) -> np.ndarray:
        """Thrusts of the first step, N; where the vehicle should be is of no interest."""
        return self.step(position, velocity, angles, target)

    def step(self, position: np.ndarray, velocity: np.ndarray, angles: np.ndarray, target: Any) -> np.ndarray:
        """Thrusts of the next step, N."""
        yaw = angles[2]
        ahead = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
        feedback = -STIFFNESS * np.concatenate([ahead @ position, angles])
        wrench = self._wrenches[len(self.thrusts)] + feedback
        self.thrusts.append(np.clip(self._inverse @ wrench, -LARGEST, LARGEST))
        return self.thrusts[-1]


def dive_log(kth: Any, rov: Any, generator: np.random.Generator, duration: float, name: str) -> Log:
    """The log of a dive in their simulator, with the noise of usual sensors.

    Args:
        kth: the example, as a module.
        rov: object of their class, at rest.
        generator: of random numbers.
        duration: s.
        name: of the log.
    """
    excitation = Excitation(generator, matrix_of(rov), duration)
    states = kth.simulate(rov, excitation, duration)
    times = STEP * np.arange(len(states))
    signals = {}
    for signal, (columns, names, unit) in SIGNALS.items():
        every = max(1, round(1 / (SENSORS[signal].rate * STEP)))
        values = states[::every, columns]
        noisy = values + SENSORS[signal].noise * generator.standard_normal(values.shape)
        signals[signal] = Series(times[::every], noisy, names, unit)
    thrusts = np.array(excitation.thrusts)
    signals["input"] = Series(times, thrusts, tuple(f"T{i + 1}" for i in range(thrusts.shape[1])), "N")
    roll, pitch = np.degrees(np.abs(states[:, 3:5]).max(axis=0))
    velocities = ", ".join(f"{value:.2f}" for value in states[:, 6:].std(axis=0))
    print(f"{name}: {duration:g} s, roll up to {roll:.0f} deg, pitch up to {pitch:.0f} deg, ", end="")
    print(f"standard deviations of u v w p q r {velocities} m/s and rad/s", flush=True)
    return Log(signals, name, "KTH")


def matrix_of(rov: Any) -> np.ndarray:
    """Forces and moments per newton of each of their thrusters, (6, 8)."""
    directions = np.array([thruster["dir"] for thruster in rov.thrusters_r])
    arms = np.array([thruster["r"] for thruster in rov.thrusters_r])
    return np.concatenate([directions, np.cross(arms, directions)], axis=1).T


def numbers_of(rov: Any) -> dict[str, float]:
    """What their object says, by the names of undertow; the lag in s."""
    numbers = {f"added_mass.{axis}": rov.MA[i, i] for i, axis in enumerate(BODY_AXES)}
    for kind, names in zip(("linear_damping", "quadratic_damping"), DAMPING_NAMES, strict=True):
        numbers |= {f"{kind}.{axis}": -getattr(rov, name) for axis, name in zip(BODY_AXES, names, strict=True)}
    numbers |= {"net_buoyancy": rov.B - rov.W, "r_b.x": rov.xb, "r_b.y": rov.yb, "r_b.z": rov.zb}
    numbers |= {"thruster_gain": 1.0, "reverse_gain": 1.0, "lag": mean_delay(rov.thruster_lags[0])}
    return {name: abs(float(value)) if value == 0 else float(value) for name, value in numbers.items()}


def mean_delay(lag: Any) -> float:
    """Mean of the impulse response of one of their lags, s: -K'(0)/K(0) of K(s) = C (s - A)^-1 B."""
    output = np.ravel(lag._Cc)
    at_rest = np.linalg.solve(lag._Ac, lag._Bc)
    return float(np.squeeze(-output @ np.linalg.solve(lag._Ac, at_rest) / (output @ at_rest)))


def replace_by_one_pole(lag: Any) -> None:
    """Make one of their lags one of first order with the same mean delay."""
    rate = np.array([[1 / mean_delay(lag)]])
    lag._Ac, lag._Bc, lag._Cc, lag._Dc, lag._x = -rate, rate, np.ones((1, 1)), np.zeros((1, 1)), np.zeros(1)


def prior_scenario(kth: Any, rov: Any, truth: dict[str, float], generator: np.random.Generator) -> dict[str, Any]:
    """A scenario whose vehicle and lag are off by 30 %, at random too large or too small.

    A number of their damping that is 0 begins at 30 % of the damping of the other kind, at 0.5 m/s or 1 rad/s.
    """
    off = {name: value * (1 + OFF * generator.choice([-1.0, 1.0])) for name, value in truth.items()}
    for axis, speed in zip(BODY_AXES, (0.5, 0.5, 0.5, 1.0, 1.0, 1.0), strict=True):
        if truth[f"linear_damping.{axis}"] == 0:
            off[f"linear_damping.{axis}"] = OFF * speed * truth[f"quadratic_damping.{axis}"]
    matrix = lambda name: np.diag([off[f"{name}.{axis}"] for axis in BODY_AXES]).tolist()
    vehicle = {
        "kind": "bluerov2_heavy",
        "mass": rov.m,
        "weight": rov.W,
        "buoyancy": rov.W + off["net_buoyancy"],
        "inertia": rov.MRB[3:, 3:].tolist(),
        "r_b": [off[f"r_b.{axis}"] for axis in "xyz"],
        "thruster_positions": [thruster["r"].tolist() for thruster in rov.thrusters_r],
        "thruster_directions": [thruster["dir"].tolist() for thruster in rov.thrusters_r],
    }
    vehicle |= {name: matrix(name) for name in ("added_mass", "linear_damping", "quadratic_damping")}
    thruster = kth.SCENARIO["plant"]["thruster"] | {"time_constant": off["lag"]}
    return kth.SCENARIO | {"plant": {"vehicle": vehicle, "thruster": thruster}}


def print_intervals(model: ut.IdentifiedModel, truth: dict[str, float], time_constant: float) -> None:
    """Each number of their file beside its estimate; what is missed is marked."""
    print(f"\n{'number':24}{'file':>11}{'prior':>11}{'estimate':>11}{'from':>11}{'to':>11}  unit")
    inside = 0
    for name, interval in model.parameters.items():
        scale, unit = (1e3 * time_constant, "ms") if name == "lag" else (1.0, interval.parameter.unit)
        true = 1e3 * truth[name] if name == "lag" else truth[name]
        low, high = scale * interval.low, scale * interval.high
        inside += low <= true <= high
        verdict = "" if low <= true <= high else "   MISSED"
        numbers = (scale * interval.parameter.prior, scale * interval.value)
        print(f"{name:24}{true:11.4g}{numbers[0]:11.4g}{numbers[1]:11.4g}{low:11.4g}{high:11.4g}  {unit}{verdict}")
    print(f"{inside} of {len(model.parameters)} numbers are inside their 95 % intervals")


def print_fits(model: ut.IdentifiedModel) -> None:
    """Free runs over the second dive, which was not used."""
    unseen = model.result.validation[-1]
    print(f"\n{'fit of the second dive, %':32}" + "".join(f"{axis:>7}" for axis in unseen.identified.fit))
    rows = {"identified": unseen.identified, "prior": unseen.prior}
    rows |= {f"published, {name}": errors for name, errors in unseen.published.items()}
    for name, errors in rows.items():
        print(f"{name:32}" + "".join(f"{fit:7.1f}" for fit in errors.fit.values()))


def _example() -> Any:
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("kth_bluerov2", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    main()
