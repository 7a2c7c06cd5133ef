"""Scenarios as files, and vehicles that are compiled once."""

import pytest
from ruamel.yaml import YAML

from undertow.interop.stepped_vehicle import SteppedVehicle

# A vehicle with speed controllers, which round the input to pulses as an autopilot does.
DRIVEN = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}, "esc": "esc"},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1, 0.5, 0.5, 0, 0, 0.5], "settling": 3},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "initial": {"position": [0.1, -0.2, 0.3, 0.2, -0.1, 0.4], "velocity": [0.1, 0, 0.2, 0, 0.05, 0]},
    "loop": {"duration": 2.0, "dt": 0.01, "record": 0.01},
}


@pytest.fixture(scope="session")
def written(tmp_path_factory):
    """A function that writes a scenario to a file."""
    folder, count = tmp_path_factory.mktemp("scenarios"), iter(range(1000))

    def write(scenario):
        path = folder / f"scenario{next(count)}.yaml"
        with path.open("w", encoding="utf-8") as file:
            YAML().dump(scenario, file)
        return path

    return write


@pytest.fixture(scope="session")
def driven(written):
    """The file of `DRIVEN`."""
    return written(DRIVEN)


@pytest.fixture(scope="session")
def compiled(driven):
    """The vehicle of `DRIVEN`, for all tests: `vehicle` puts it at the start."""
    return SteppedVehicle(driven)


@pytest.fixture
def vehicle(compiled):
    compiled.restart()
    return compiled
