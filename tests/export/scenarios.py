"""Scenarios of these tests."""

HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5},
    "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves"}],
    "initial": {"position": [0.1, 0, 0, 0, 0, 0.3]},
    "loop": {"duration": 10.0, "dt": 0.01, "record": 0.01},
    "seed": 3,
}
ODIN = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "electromechanical"}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5},
    "disturbance": "u1",
    "loop": {"duration": 2.0, "dt": 0.001, "record": 0.001, "substeps": 2},
}
PENDULUM = {
    "description": 'a pendulum /* in a "comment" */ at 5\u00b0, 50 % \\',  # which C and XML must survive
    "plant": "inverted_pendulum",
    "controller": "paper",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "disturbance": {"kind": "random_suite", "axes": 1, "span": 4},
    "initial": {"position": [0.05]},
    "loop": {"duration": 1.0, "dt": 0.001, "record": 0.001},
}
NAVIGATED = HEAVY | {
    "description": "a vehicle that loses thrusters",
    "controller": "robust",
    "navigation": {
        "kind": "observer",
        "sensors": ["imu", {"kind": "dvl", "delay": 0.05}, "depth", "compass", "position_fix"],
    },
    "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves", "height": 0.5, "period": 5}],
    "loop": {"duration": 6.0, "dt": 0.01, "record": 0.01},
}
