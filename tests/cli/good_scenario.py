"""A scenario without a mistake; the tests make one in it. Line numbers count."""

SCENARIO = """\
plant:
  vehicle: {kind: odin, mass: 125}
  thruster: {kind: paper_table3, fidelity: ideal}
controller: {kind: paper,
  feedback: [1, 2],
  weight: [[10, 0], [0, 10]]}
reference: {kind: setpoint, position: [2, 3, 4, 0, 0, 1]}
disturbance: {kind: u1}
loop: {duration: 0.1, dt: 1e-3, record: 1e-2}
initial: {position: [0, 0, 0, 0, 0, 0]}
seed: 3
"""

# Where the vehicle is not what is looked at: one axis, with noise.
SMALL = """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid, frequency: 2}
reference: {kind: setpoint, position: [1]}
disturbance: {kind: sinusoid, amplitude: 1}
navigation: {kind: white_noise, velocity: 0.01}
steady: {start: 0.05, stop: 0.1}
loop: {duration: 0.1, dt: 1e-3, record: 1e-2}
seed: 3
"""
