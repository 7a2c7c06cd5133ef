"""The scenario of these tests."""

# A vehicle with speed controllers, which round the input to pulses as an autopilot does.
DRIVEN = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}, "esc": "esc"},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1, 0.5, 0.5, 0, 0, 0.5], "settling": 3},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "initial": {"position": [0.1, -0.2, 0.3, 0.2, -0.1, 0.4], "velocity": [0.1, 0, 0.2, 0, 0.05, 0]},
    "loop": {"duration": 2.0, "dt": 0.01, "record": 0.01},
}
