"""Valid files that hostile inputs are made of: scenarios that use every kind of part, and the other files of a user."""

from typing import Any

# All are valid and short; between them they use most parts and most keys.
SCENARIOS: dict[str, str] = {
    "heavy": """\
plant:
  kind: hybrid_vehicle
  vehicle: {kind: bluerov2_heavy, parameters: vonbenzon2022}
  thruster: {kind: t200, supply: 16}  # V
model: {rate_term: true}
controller:
  kind: robust
reference:
  kind: setpoint
  position: [2, 1, 1, 0, 0, 0.5]  # m, rad
  settling: 20  # s
disturbance:
  - kind: current
    velocity: [0.3, 0.2, 0]  # m/s
  - {kind: waves, height: 0.5, period: 5}
navigation:
  kind: observer
  sensors:
    - imu
    - {kind: dvl, period: 0.125, noise: 0.005, delay: 0.05}
    - depth
    - compass
    - {kind: position_fix, period: 1, noise: 0.05, delay: 0.2}
loop: {kind: sampled, dt: 0.01, duration: 1, record: 0.05}
""",
    "paper": """\
plant:
  vehicle: odin
  thruster: {kind: paper_table3, fidelity: ideal}
model: {speed_sensor: true}
controller:
  kind: paper
  feedback: [1, 2]  # 1/s^2, 1/s
  weight: [[10, 0], [0, 10]]
  adaptation: 100
  composite: 500
  robust_gain: 10
  layer: 0.5
  pole: 150
  fuzzy_input: error
  sets: 5
reference: {kind: setpoint, position: [2, 3, 4, 1.04, 0.78, 1.25]}
disturbance: u1
loop: {kind: continuous, duration: 1}
""",
    "kalman": """\
plant:
  vehicle: bluerov2
  thruster: {kind: t200, fidelity: static}
  battery: {kind: battery, capacity: 18}
controller: {kind: pid, frequency: 1.5}
reference: {kind: lissajous}
disturbance:
  - {kind: gauss_markov_current, mean: [0.1, 0, 0]}
  - {kind: tether, length: 30}
navigation:
  kind: kalman
  sensors: [imu, {kind: dvl, noise: 0.01}, depth, compass]
loop: {dt: 0.02, duration: 1, record: 0.1}
initial: {position: [0, 0, 0, 0, 0, 0.1], velocity: [0, 0, 0, 0, 0, 0]}
steady: {start: 0.5, stop: 1.0, every_step: true}
success: {position_rms: 0.5}
precision: float64
""",
    "odin": """\
plant:
  vehicle: {kind: odin, mass: 125.0, r_g: [0, 0, 0.05]}
  thruster: {kind: paper_table3, fidelity: electromechanical, supply: 24.0}
controller: {kind: adrc}
reference: {kind: waypoints, points: [[0, 0, 0], [1, 1, 0]], speed: 0.2}
faults:
  - {target: thruster 1, mode: fraction, severity: 0, onset: 0.3}
navigation: {kind: degraded, position_noise: 0.01, velocity_noise: 0.01, delay: 0.02}
loop: {dt: 0.01, duration: 0.5, record: 0.05, substeps: 2, method: rk4}
""",
    "pendulum": """\
plant: inverted_pendulum
model: {half_length: 0.35}
reference: {kind: sine, amplitude: 0.1, frequency: 1}
initial: {position: [0.05]}
loop: {duration: 0.5}
""",
    "levitation": """\
plant: magnetic_levitation
reference: {kind: sine, amplitude: 0.001, frequency: 1, offset: 0.008}
initial: {position: [0.008]}
loop: {duration: 0.1}
""",
    "arm": """\
plant: {kind: two_link_arm}
controller: {kind: indi}
reference: {kind: sine, amplitude: [0.3, 0.2], frequency: [1, 2]}
navigation: {kind: white_noise, position: 0.0001, velocity: 0.001}
loop: {duration: 0.5, dt: 0.002, record: 0.01}
precision: float32
""",
    "axis": """\
plant: {kind: double_integrator, axes: 1, limit: 20.0}
controller: {kind: pid, frequency: 2.0}
reference: {kind: setpoint, position: [0.0]}
disturbance: {kind: sinusoid, amplitude: 1.0}
navigation: {kind: white_noise, velocity: 0.01}
loop: {duration: 2.0, dt: 0.02, record: 0.1}
""",
    "linear": """\
plant: {kind: linear_plant, position_term: [[-1.0]], velocity_term: [[-0.5]], gain: [[2.0]]}
controller: {kind: pid}
reference: {kind: setpoint, position: [1.0]}
loop: {duration: 1.0, dt: 0.01, record: 0.1}
""",
    "recorded": """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid}
reference: {kind: setpoint, position: [0]}
disturbance: {kind: table, file: d.csv}
loop: {duration: 0.04, dt: 0.01, record: 0.01}
""",
    "own_vehicle": """\
plant: {vehicle: {kind: vehicle.yaml, mass: 12.0}, thruster: t200}
controller: {kind: pid}
reference: {kind: circle, radius: 2.0}
disturbance:
  - {kind: parameter_error, mass: [0.9, 1.1]}
  - {kind: payload, mass: 3.0, weight: 5.0}
  - {kind: sheared_current}
loop: {dt: 0.01, duration: 0.3, record: 0.05}
""",
}

TABLE = "t,d1\n0,1\n0.5,-1.5\n1.0,2\n1.5,0.25\n"

VEHICLE = """\
name: my_rov
mass: 11.2  # kg
volume: 0.0113  # m^3
water_density: 1000  # kg/m^3
inertia: [0.24, 0.23, 0.38]  # kg m^2
inertia_about: centre_of_gravity
r_g: [0, 0, 0]  # m
r_b: [0, 0, -0.02]  # m
added_mass: [5.5, 12.7, 14.57, 0.12, 0.12, 0.12]
linear_damping: [13.7, 0, 33.0, 0, 0.8, 0]
quadratic_damping: [141.0, 217.0, 190.0, 1.19, 0.47, 1.5]
thrusters:
  - {position: [0.156, 0.111, 0.085], direction: [0.7071, -0.7071, 0]}
  - {position: [0.156, -0.111, 0.085], direction: [0.7071, 0.7071, 0]}
  - {position: [-0.156, 0.111, 0.085], direction: [0.7071, 0.7071, 0]}
  - {position: [-0.156, -0.111, 0.085], direction: [0.7071, -0.7071, 0]}
  - {position: [0.12, 0.218, 0], direction: [0, 0, 1]}
  - {position: [0.12, -0.218, 0], direction: [0, 0, 1]}
  - {position: [-0.12, 0.218, 0], direction: [0, 0, 1]}
  - {position: [-0.12, -0.218, 0], direction: [0, 0, 1]}
"""

CAMPAIGN = """\
scenario:
  plant: {kind: double_integrator, axes: 1, limit: 20.0}
  controller: {kind: pid, frequency: 2.0}
  reference: {kind: setpoint, position: [0.0]}
  disturbance: {kind: sinusoid, amplitude: 1.0}
  navigation: {kind: white_noise, velocity: 0.01}
  loop: {duration: 2.0, dt: 0.02, record: 0.1}
trials: 12
chunk: 4
vary:
  disturbance.amplitude: {uniform: [0.5, 2.0]}
  controller.frequency: {normal: [2.0, 0.1]}
cross:
  loop.method: [rk4, euler]
requirements:
  position_rms: {below: 0.2, share: 0.5}
series: {signals: [position], every: 0.1}
seed: 7
"""

MAPPING = """\
time: {column: time_ms, unit: ms}
world: ENU
body: FLU
signals:
  position: {columns: [x, y, z]}
  attitude: {columns: [roll, pitch, yaw], unit: deg}
  input: {columns: [p1, p2], unit: us, supply: 16}
"""

LOG = "time_ms,x,y,z,roll,pitch,yaw,p1,p2\n" + "".join(
    f"{100 * i},{0.1 * i:.2f},{0.2 * i:.2f},-1,{i},{-i},{3 * i},{1500 + i},{1500 - i}\n" for i in range(12)
)

PLUG_IN = """\
import jax.numpy as jnp

from undertow.control.controllers.pid import pid


def law(model, frequency=1.0):
    return pid(model, frequency=frequency)
"""

PLUGGED = """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: ./mine.py:law, frequency: 1.5}
reference: {kind: setpoint, position: [0]}
loop: {duration: 0.04, dt: 0.01, record: 0.01}
"""


def scenario_files(text: str) -> dict[str, bytes]:
    """Files of a scenario: its text as s.yaml, and what it may name."""
    return {"s.yaml": text.encode("utf-8", "surrogatepass"), "d.csv": TABLE.encode(), "vehicle.yaml": VEHICLE.encode()}


def described() -> dict[str, Any]:
    """Names and numbers of the specimens, for the report."""
    return {"scenarios": len(SCENARIOS), "vehicles": 1, "campaigns": 1, "tables": 1, "mappings": 1, "plug_ins": 1}
