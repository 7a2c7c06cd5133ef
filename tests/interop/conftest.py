"""Scenarios as files, and vehicles that are compiled once."""

import pytest
from driven_scenario import DRIVEN
from ruamel.yaml import YAML

from undertow.outside.stepped_vehicle import SteppedVehicle


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
