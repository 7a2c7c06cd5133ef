"""A scenario without a mistake; the tests make one in it. Line numbers count."""

SCENARIO = """\
plant:
  vehicle: {kind: odin, mass: 125}
  thruster: {kind: paper_table3, fidelity: ideal}
controller:
  feedback: [1, 2]
  weight: [[10, 0], [0, 10]]
reference: {kind: setpoint, position: [2, 3, 4, 0, 0, 1]}
disturbance: {kind: u1}
loop: {duration: 0.1, dt: 1e-3, record: 1e-2}
initial: {position: [0, 0, 0, 0, 0, 0]}
seed: 3
"""
