"""Published parameter sets beside the prior: a dive of one of them is predicted by that one."""

from pathlib import Path

import numpy as np
import pytest

import undertow as ut
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.report.identification_page import write_identification
from undertow.scenario.build import build
from undertow.scenario.parameter_sets import parameter_sets, plant_with_set, published_plants
from undertow.scenario.reading import from_data
from undertow.studies.identification.simulated_dive import SensorSpecification, telegraph_dive

SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "robust",
    "reference": {"kind": "setpoint", "position": [0] * 6},
    "loop": {"duration": 1, "dt": 0.02, "record": 0.02},
}
OTHERS = ["wu2018", "ng2024", "gazebo_box_drag", "px4"]
# Of fits: noise is no error of a model.
PRECISE = {
    "position": SensorSpecification(5.0, 0.001),
    "attitude": SensorSpecification(20.0, 0.0005),
    "body_velocity": SensorSpecification(10.0, 0.001),
    "angular_velocity": SensorSpecification(50.0, 0.0005),
}


def with_vehicle(vehicle):
    return build(from_data(SCENARIO | {"plant": SCENARIO["plant"] | {"vehicle": vehicle}}))


@pytest.fixture(scope="module")
def identified():
    """The vehicle of Ng (2024) from a dive, with von Benzon's numbers as the prior."""
    with in_precision("float64"):
        vehicle = hybrid_vehicle(bluerov2_heavy("ng2024"), t200())
        log = telegraph_dive(vehicle, {}, 3, 24.0, sensors=PRECISE)
    return ut.identify(SCENARIO, log, free=("quadratic_damping.surge", "thruster_gain"))


@pytest.mark.full
def test_the_set_of_a_dive_predicts_it(identified):
    published = identified.data["published"]
    assert list(published) == OTHERS
    for axis, fit in published["ng2024"].items():
        before = [validation["prior"]["free_run_fit"][axis] for validation in identified.data["validation"]]
        assert fit > 90, axis
        assert fit > np.mean(before) + 20, axis
        assert fit > max(published[name][axis] for name in OTHERS if name != "ng2024") + 20, axis


@pytest.mark.full
def test_the_page_has_a_row_for_each_set(identified, tmp_path):
    write_identification("heavy", identified.result, identified.data, tmp_path, tmp_path)
    page = (tmp_path / "identification.html").read_text()
    assert [page.count(f"published: {name}<") for name in OTHERS] == [1] * 4
    assert "published: vonbenzon2022" not in page


def test_sets_have_their_printed_numbers():
    plants = published_plants(with_vehicle("bluerov2_heavy"))
    masses = {name: float(plant.vehicle.mass) for name, plant in plants.items()}
    assert masses == {"wu2018": 11.5, "ng2024": 11.5, "gazebo_box_drag": 13.0, "px4": 13.4}


def test_a_scenario_that_changes_numbers_is_no_published_set():
    """Its own set as printed is then among the others, all in the layout of the scenario."""
    built = with_vehicle({"kind": "bluerov2_heavy", "parameters": "px4", "layout": "wu2018", "mass": 20.0})
    plants = published_plants(built)
    assert set(plants) == {*OTHERS, "vonbenzon2022"}
    assert float(plants["px4"].vehicle.mass) == pytest.approx(13.4)
    assert float(plant_with_set(built, "ng2024").vehicle.mass) == 20.0
    vertical = [np.asarray(plant.vehicle.thruster_directions)[4:, 2].tolist() for plant in plants.values()]
    assert vertical == [[-1, 1, 1, -1]] * 5


@pytest.mark.parametrize("vehicle", ["odin", str(Path(__file__).parents[2] / "examples" / "my_rov.yaml")])
def test_a_vehicle_of_one_set_has_none(vehicle):
    built = with_vehicle(vehicle)
    assert parameter_sets(built) == () and published_plants(built) == {}
