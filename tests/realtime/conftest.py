"""Scenarios and links for tests of the real-time loop."""

import pytest

from undertow.outside.realtime import control_loop
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "loop": {"duration": 1.0, "dt": 0.01, "record": 0.01},
}


@pytest.fixture(autouse=True)
def garbage_stays(monkeypatch):
    """A loop collects garbage before it begins: a second, where as many modules are loaded as here."""
    monkeypatch.setattr(control_loop.gc, "collect", lambda: 0)


@pytest.fixture(scope="session")
def heavy():
    return build(from_data(HEAVY))


@pytest.fixture(scope="session")
def heavy_data():
    return HEAVY
