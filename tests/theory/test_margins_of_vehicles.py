"""`analyze` over the vehicles within the deviations of a vehicle file."""

from pathlib import Path

import numpy as np
import pytest

from undertow.cli.main import run
from undertow.report.answers.analysis_answer import answer_of_prediction
from undertow.scenario.build import build
from undertow.scenario.reading import read
from undertow.scenario.sampled_plants import OF_FILE, sampled_plants
from undertow.scenario.vehicle_file import vehicle_file_of
from undertow.scenario.vehicle_keys import vehicle_keys
from undertow.scenario.vehicle_samples import sample
from undertow.studies.campaign.varied_scenario import varied_scenario
from undertow.studies.prediction.predict import predict, summary

pytestmark = pytest.mark.full


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    """A scenario with a vehicle file of two deviations."""
    monkeypatch.chdir(tmp_path)
    assert run(["init", "--own-vehicle"]) == 0
    file = Path("my_rov.yaml").read_text()
    file = file.replace("mass: 13.5  ", "mass: 13.5 +- 2")
    Path("my_rov.yaml").write_text(file.replace("[141, 217, 190", '["141 +- 40 %", 217, 190'))
    return read(Path("scenario.yaml"))


def test_plants_have_the_numbers_of_the_samples(scenario):
    built = build(scenario)
    samples = sample(vehicle_file_of(scenario), 3, 4)
    plants = sampled_plants(built, 3, 4)
    assert next(iter(plants)) == OF_FILE and plants.pop(OF_FILE) is built.closed_loop.plant
    masses = [float(plant.vehicle.mass) for plant in plants.values()]
    drags = [float(plant.vehicle.quadratic_damping[0, 0]) for plant in plants.values()]
    np.testing.assert_array_equal(masses, samples["mass"])
    np.testing.assert_array_equal(drags, samples["quadratic_damping.surge"])
    assert all(float(plant.vehicle.weight / plant.vehicle.mass) == pytest.approx(9.82) for plant in plants.values())


def test_margins_over_vehicles(scenario):
    """Those of each vehicle are those of a scenario that has its numbers in the plant and the file's in the model."""
    built = build(scenario)
    prediction = predict(built, vehicles=3)
    assert len(prediction.vehicles) == 3 and all(vehicle.is_stable for vehicle in prediction.vehicles)
    samples = sample(vehicle_file_of(scenario), built.scenario.seed, 3)
    values = {key: float(samples[name][1]) for name, key in vehicle_keys(samples, scenario).items()}
    alone = predict(build(scenario._replace(data=varied_scenario(scenario.data, values))))
    assert prediction.vehicles[1].margins == pytest.approx(alone.margins, rel=1e-6)
    assert prediction.vehicles[1].margins["delay"] != pytest.approx(prediction.margins["delay"], rel=1e-3)
    text = answer_of_prediction(prediction).text
    assert sum("stable with 3 vehicles within the deviations of the file" in line for line in text) == 1
    assert [vehicle["name"] for vehicle in summary(prediction)["vehicles"]] == [v.name for v in prediction.vehicles]
    unstable = prediction._replace(vehicles=(prediction.vehicles[0]._replace(radius=1.01), *prediction.vehicles[1:]))
    assert any("Of 3 vehicles" in line and "1 is not stable" in line for line in answer_of_prediction(unstable).text)
    assert not answer_of_prediction(unstable).good


def test_an_unstable_loop_has_no_margins(scenario):
    prediction = predict(build(scenario))
    assert prediction.vehicles == ()
    point = prediction.points[0]._replace(radius=1.1)
    text = answer_of_prediction(prediction._replace(points=(point, *prediction.points[1:]))).text
    assert text[0].startswith("The closed loop is unstable")
    assert not any("stays stable" in line or "Predicted" in line or "no time" in line for line in text)
