"""What `undertow identify` makes of real dives, beside what others published about them.

The logs are not part of the project. The folder has, each in a folder of its own,

* `heavy_mocap`: a BlueROV2 Heavy in a tank with motion capture, steered by hand (SAABmarine-MEX/saabmarineMEX_learning,
  2025), four tables `run_*.csv` with the sticks of the pilot and the velocities of the owners' simulator;
* `bluerov2016_bags`: a BlueROV of 2016 with designed inputs (Ekelund and Wahlstrom, thesis, Linkoping 2016), bags of
  ROS 1;
* `auv_pool`: an AUV under control in a pool (Tartan-AUV/TAUV-Playground, 2022), tables with states and demanded
  wrenches.

`python benchmarks/real_dives.py FOLDER` prints a table for each; `--only heavy_mocap` for one of them.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.runtime import in_precision
from undertow.studies.identification.estimates import METHODS
from undertow.studies.identification.validation import prediction_errors

AXES = ("u", "v", "w", "p", "q", "r")

HEAVY = """
plant: {vehicle: bluerov2_heavy, thruster: {kind: t200, supply: 16}}
controller: robust
reference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0]}
loop: {dt: 0.01, duration: 1}
"""
STICKS = """
time: {column: time, unit: s}
signals:
  position: {columns: [x, y, z]}
  attitude: {columns: [roll, pitch, yaw]}
  body_velocity: {columns: [u, v, w]}
  angular_velocity: {columns: [p, q, r]}
  input: {columns: [axis_4, axis_5, axis_2, axis_1, axis_0, axis_3], unit: "1", supply: 1}
"""
BARS = (70, 65, 50, 35, 25, 45)

WRENCHES = """
time: {column: time, unit: s}
signals:
  position: {columns: [field.position.x, field.position.y, field.position.z]}
  attitude: {columns: [field.orientation.x, field.orientation.y, field.orientation.z]}
  body_velocity: {columns: [field.velocity.x, field.velocity.y, field.velocity.z]}
  angular_velocity:
    {columns: [field.angular_velocity.x, field.angular_velocity.y, field.angular_velocity.z]}
  input: {columns: [force.x, force.y, force.z, torque.x, torque.y, torque.z], unit: "1", supply: 1}
"""

# Geometry of the thesis; its force balance says that T1 and T3 are to port. Inertia and added inertia are guesses,
# about which the dives have to say more. The lateral thruster's height is not printed. No velocity was measured: added
# masses that are equal along the three axes leave out the moment of the unknown flow.
BLUEROV = """
name: bluerov_2016
source: Ekelund and Wahlstrom, thesis, Linkoping 2016
size: [0.46, 0.34, 0.25]
mass: 6.621
buoyancy: 65.0
gravity: 9.82
r_g: [0, 0, 0]
r_b: [0, 0, -0.03]
inertia: [0.1, 0.12, 0.15]
inertia_about: centre_of_gravity
added_mass: [6, 6, 6, 0.5, 0.5, 0.5]
linear_damping: [5, 8, 10, 1, 1, 1]
quadratic_damping: [15, 25, 40, 0.5, 0.3, 0.5]
thrusters:
  - {position: [0.19, -0.11, 0], direction: [0, 0, -1]}
  - {position: [0.19, 0.11, 0], direction: [0, 0, -1]}
  - {position: [0, -0.11, 0], direction: [1, 0, 0]}
  - {position: [0, 0.11, 0], direction: [1, 0, 0]}
  - {position: [-0.17, 0, 0], direction: [0, 0, -1]}
  - {position: [0, 0, 0], direction: [0, -1, 0]}
"""
# Of their bench: 50 N at full command forward, 40 N in reverse.
BLUEROV_SCENARIO = """
plant:
  vehicle: bluerov.yaml
  thruster:
    {kind: first_order, thrust_per_volt: 50, power: 1.4, reverse_share: 0.8, linear_gain: 45, supply: 1}
controller: robust
reference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0]}
loop: {dt: 0.01, duration: 1}
"""
BLUEROV_COLUMNS = """
signals:
  attitude: {topic: /sensor_fusion/states, columns: ["data[0]..data[2]"]}
  angular_velocity: {topic: /sensor_fusion/states, columns: ["data[3]..data[5]"]}
  input: {topic: /rovio/thrusters, columns: ["data[0]..data[5]"], unit: us, supply: 1}
"""
BLUEROV_DIVES = ("yaw_1", "yaw_2", "pitch_roll_1", "pitch_roll_2", "all_3")
BLUEROV_PRIORS = {
    "added_mass.roll": "0.5 +- 0.5", "added_mass.pitch": "0.5 +- 0.5", "added_mass.yaw": "0.5 +- 0.5",
}  # fmt: skip
BLUEROV_FREE = (
    *(f"{kind}.{axis}" for kind in ("linear_damping", "quadratic_damping") for axis in ("roll", "pitch", "yaw")),
    "r_b", "lag", "thruster_gain", "reverse_gain",
)  # fmt: skip
# Prediction-error method, and extended Kalman filter; kg m^2, N m s, N m s^2, m.
THESIS = {
    "A_p": (1.0924, 0.8337), "B_q": (0.8162, 0.7987), "C_r": (1.1519, 1.1250),
    "linear_damping.roll": (0.916, 0.884), "quadratic_damping.roll": (0.759, 0.668),
    "linear_damping.pitch": (0.856, 0.855), "quadratic_damping.pitch": (0.340, 0.335),
    "linear_damping.yaw": (1.027, 1.028), "quadratic_damping.yaw": (1.024, 1.025),
    "r_b.z": (-0.0463, -0.0420),
}  # fmt: skip


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser()
    options.add_argument("folder", type=Path)
    options.add_argument("--only", choices=tuple(STUDIES))
    options.add_argument("--method", choices=METHODS, default=METHODS[0])
    arguments = options.parse_args()
    for name, study in STUDIES.items():
        if arguments.only in (None, name):
            print(f"\n{name}", flush=True)
            with tempfile.TemporaryDirectory() as work:
                study(arguments.folder / name, Path(work), arguments.method)


def heavy_mocap(folder: Path, work: Path, method: str) -> None:
    """Each run from the others, and from all; free runs from the first sample, beside the owners' simulator."""
    scenario, mapping = _written(work, "heavy.yaml", HEAVY), _written(work, "sticks.yaml", STICKS)
    files = sorted(folder.glob("*.csv"))
    logs = [ut.read_log(file, mapping=mapping) for file in files]
    model = ut.identify(scenario, logs, per_axis=True, method=method, step=0.1)
    rows = [np.array([validation.identified.fit[axis] for axis in AXES]) for validation in model.result.validation]
    _print_fits([*(file.stem for file in files), "mean"], [*rows, np.mean(rows, axis=0)])
    found = model.result
    with in_precision("float64"):
        inside = [prediction_errors(found.model, found.z, dive).fit for dive in found.dives]
    rows = [np.array([fit[axis] for axis in AXES]) for fit in inside]
    _print_fits([*(f"{file.stem}, used" for file in files), "mean, used"], [*rows, np.mean(rows, axis=0)])
    theirs = [_simulator_fit(file) for file in files]
    _print_fits([*(f"{file.stem}, owners" for file in files), "mean, owners"], [*theirs, np.mean(theirs, axis=0)])
    _print_fits(["at least"], [np.array(BARS)])


def bluerov2016(folder: Path, work: Path, method: str) -> None:
    """Fitted on five dives, free run on a sixth; the numbers beside the thesis."""
    _written(work, "bluerov.yaml", BLUEROV)
    scenario, mapping = _written(work, "rov.yaml", BLUEROV_SCENARIO), _written(work, "columns.yaml", BLUEROV_COLUMNS)
    bag = lambda name: ut.read_log(next(folder.glob(f"{name}_*.bag")), mapping=mapping)
    dives = [bag(name) for name in BLUEROV_DIVES]
    # It tumbles, and its attitude is filtered, so that it does not follow from the rates: short segments.
    options = {"free": BLUEROV_FREE, "priors": BLUEROV_PRIORS, "segment": 5.0, "method": method}
    model = ut.identify(scenario, dives, unseen=[bag("all_2")], **options)
    for finding in model.result.findings:
        print(finding)
    unseen = model.result.validation[-1]
    fits = np.array([unseen.identified.fit[axis] for axis in AXES])
    print("free run over a whole minute, attitude included; that of the thesis takes the measured attitude as an input")
    _print_fits(["all_2, not used", "thesis, another dive"], [fits, np.array([np.nan] * 3 + [60, 60, 50])])
    spread = unseen.dive.values[:, 10:13].std(axis=0)
    shares = [100 * (1 - ahead[9:12] / spread) for ahead in unseen.identified.ahead]
    rows = [np.concatenate([np.full(3, np.nan), share]) for share in shares]
    _print_fits(["all_2, 1 s ahead", "5 s ahead", "10 s ahead"], rows)
    print(f"{'':28}{'estimate':>10}{'from':>10}{'to':>10}   thesis")
    for name, theirs in THESIS.items():
        value, low, high = _interval(model, name)
        place = "inside" if low <= min(theirs) and max(theirs) <= high else "outside"
        print(f"{name:28}{value:10.3g}{low:10.3g}{high:10.3g}   {theirs[0]:g}, {theirs[1]:g}: {place}")


def auv_pool(folder: Path, work: Path, method: str) -> None:
    """Which axes are refused, and why."""
    scenario, mapping = _written(work, "auv.yaml", HEAVY), _written(work, "wrenches.yaml", WRENCHES)
    for states in sorted(folder.glob("navigation_state_*.csv")):
        file = _joined(states, folder / states.name.replace("navigation_state", "wrench"), work)
        try:
            model = ut.identify(scenario, file, mapping, per_axis=True, method=method, step=0.1)
        except BadInput as error:
            print(f"{file.name}: {error}")
            continue
        print(f"{file.name}: refused {', '.join(model.result.refused_axes) or 'nothing'}")
        for finding in model.result.findings:
            print(f"    {finding}")


STUDIES = {"heavy_mocap": heavy_mocap, "bluerov2016_bags": bluerov2016, "auv_pool": auv_pool}


def _joined(states: Path, wrenches: Path, work: Path) -> Path:
    """One table of both: a wrench is held until the next."""
    names = states.open().readline().strip().split(",")
    rows = np.genfromtxt(states, delimiter=",", skip_header=1)
    demands = np.genfromtxt(wrenches, delimiter=",", skip_header=1)
    stamp = rows[:, names.index("field.header.stamp")]
    received = rows[:, 0]
    time = (stamp - stamp[0]) * 1e-9
    last = np.searchsorted(demands[:, 0], received, side="right") - 1
    table = np.hstack([time[:, None], rows[:, 4:], demands[last.clip(0), 1:]])
    header = ["time", *names[4:], *(f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz")]
    file = work / states.name
    np.savetxt(file, table[np.diff(time, prepend=-1.0) > 0], delimiter=",", header=",".join(header), comments="")
    return file


def _interval(model: ut.IdentifiedModel, name: str) -> tuple[float, float, float]:
    """Value and 95 % interval; A_p, B_q and C_r are inertias with their added ones, of which these are known."""
    inertias = {"A_p": ("roll", 0.1), "B_q": ("pitch", 0.12), "C_r": ("yaw", 0.15)}
    axis, inertia = inertias.get(name, ("", 0.0))
    found = model.parameters[f"added_mass.{axis}" if axis else name]
    return found.value + inertia, found.low + inertia, found.high + inertia


def _simulator_fit(file: Path) -> np.ndarray:
    table = np.genfromtxt(file, delimiter=",", names=True)
    measured = np.stack([table[axis] for axis in AXES])
    theirs = np.stack([table[f"unity_{axis}"] for axis in AXES])
    return 100 * (1 - np.sqrt(((theirs - measured) ** 2).mean(axis=1)) / measured.std(axis=1))


def _print_fits(names: Sequence[str], rows: Sequence[np.ndarray]) -> None:
    print(f"{'fit, %':32}" + "".join(f"{axis:>7}" for axis in AXES))
    for name, row in zip(names, rows, strict=True):
        print(f"{name:32}" + "".join(f"{value:7.0f}" for value in row))


def _written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


if __name__ == "__main__":
    main()
