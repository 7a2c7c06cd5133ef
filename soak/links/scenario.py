"""The scenario that links are attacked with: gentle enough that nothing saturates when nothing is wrong."""

PERIOD = 0.1  # s, of the law: long, so that a machine with other work keeps up with many links at once
SUPPLY = 16.0  # V
MAX_AGE = 0.5  # s, of a measurement, as by default in all link commands

SCENARIO = f"""plant: {{vehicle: bluerov2_heavy, thruster: {{kind: t200, supply: {SUPPLY:g}}}, esc: esc}}
controller: {{kind: pid, frequency: 1.0}}
supervisor: true
reference: {{kind: setpoint, position: [0.3, 0.2, 0.2, 0, 0, 0.2], settling: 5}}
disturbance: {{kind: current, velocity: [0.2, 0.1, 0]}}
loop: {{duration: 60, dt: {PERIOD:g}, record: {PERIOD:g}}}
"""
