"""A campaign varies a vehicle within the deviations of its file; the nominal model stays that of the scenario."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import typed
from scipy import stats

from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.correlation import square_root
from undertow.scenario.reading import from_data, read
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.vehicle_file import read_vehicle
from undertow.scenario.vehicle_samples import sample
from undertow.studies.campaign.campaign_schema import Distribution, read_campaign, read_text, validate, whole
from undertow.studies.campaign.sampling import Samples, quantiles
from undertow.studies.campaign.store_results import load
from undertow.studies.campaign.trials import trials

ROV = (Path(__file__).parents[2] / "examples" / "my_rov.yaml").read_text()
SECTION = """
uncertainty:
  parameters: [mass, linear_damping.surge, net_buoyancy, r_b.z, thruster_gain, thruster_gain.T3, lag, command_delay]
  deviations: [0.4, 9, 0.3, 0.002, 0.05, 0.1, 0.2, 0.01]
  values: {thruster_gain: 0.93, command_delay: 0.02}
  correlation:
    - [1]
    - [0.2, 1]
    - [-0.3, 0.1, 1]
    - [0, 0, 0.4, 1]
    - [0.8, 0.3, 0, 0, 1]
    - [0, 0, 0, 0, -0.5, 1]
    - [0, 0, 0, 0, 0, 0, 1]
    - [0, 0, 0, 0, 0, 0, 0.6, 1]
"""
INNER = "{kind: adjusted, thruster: {kind: t200, supply: 16}, gain: [1, 1, 1, 1, 1, 1, 1, 1]}"
SCENARIO = (
    f"plant: {{vehicle: rov.yaml, thruster: {{kind: adjusted, gain: 0.93, thruster: {INNER}}}}}\ncontroller: pid\n"
    "reference: {kind: setpoint, position: [0.2, 0, 0.1, 0, 0, 0.2]}\nloop: {duration: 1, dt: 0.02, record: 0.1}\n"
    "steady: {every_step: true}\n"
)
KEYS = (
    "plant.vehicle.values.mass",
    "plant.vehicle.values.linear_damping.surge",
    "plant.vehicle.values.net_buoyancy",
    "plant.vehicle.values.r_b.z",
    "plant.thruster.gain",
    "plant.thruster.thruster.gain[2]",
    "plant.thruster.lag",
)


@pytest.fixture
def files(tmp_path):
    """Write a vehicle file, a scenario and a campaign; returns the path of the campaign."""

    def write(section=SECTION, scenario=SCENARIO, vary="{plant.vehicle: {deviations: file}}", **settings):
        (tmp_path / "rov.yaml").write_text(ROV + section)
        (tmp_path / "scenario.yaml").write_text(scenario)
        path = tmp_path / "campaign.yaml"
        lines = {"scenario": "scenario.yaml", "vary": vary, "trials": 12} | settings
        path.write_text("".join(f"{key}: {value}\n" for key, value in lines.items()))
        return path

    return write


@pytest.mark.full
def test_every_parameter_has_its_distribution(files):
    campaign_trials = trials(*read_campaign(files(trials=4000)))
    campaign = campaign_trials.campaign
    assert tuple(campaign.vary) == KEYS, "no plant has a delay of commands"
    path = campaign_trials.scenario.folder / "rov.yaml"
    expected = sample(read_vehicle(path), 1, 4000)
    del expected["command_delay"]
    found = campaign_trials.sampled(np.arange(4000))
    for key, values in zip(KEYS, expected.values(), strict=True):
        assert stats.ks_2samp(found[key], values).pvalue > 1e-3, key
    ranks = [stats.spearmanr(np.array([*columns]).T)[0] for columns in (found.values(), expected.values())]
    np.testing.assert_allclose(*ranks, atol=0.07)
    assert min(found["plant.vehicle.values.linear_damping.surge"]) == 0.0


def test_values_do_not_depend_on_what_else_is_sampled(files):
    campaign_trials = trials(*read_campaign(files(trials=50)))
    together = campaign_trials.sampled(np.arange(50))
    for row in (0, 17, 49):
        assert campaign_trials.values(row) == {key: column[row] for key, column in together.items()}


def test_the_campaign_is_kept_without_the_file(files):
    path = files()
    campaign_trials = trials(*read_campaign(path))
    text = whole(campaign_trials.campaign, campaign_trials.scenario.data)
    (path.parent / "rov.yaml").unlink()
    again = trials(*read_text(text, path.parent))
    assert again.campaign.vary == campaign_trials.campaign.vary
    assert [again.values(row) for row in range(12)] == [campaign_trials.values(row) for row in range(12)]


@pytest.mark.full
def test_a_trial_is_a_run_of_another_vehicle_which_the_controller_does_not_know(files):
    campaign_trials = trials(*read_campaign(files()))
    values = campaign_trials.values(5)
    plant = build(from_data(campaign_trials.data(5))._replace(folder=campaign_trials.scenario.folder)).closed_loop
    true = plant.plant
    assert float(true.vehicle.mass) == values["plant.vehicle.values.mass"]
    net = float(true.vehicle.buoyancy - true.vehicle.weight)
    assert net == pytest.approx(values["plant.vehicle.values.net_buoyancy"], abs=1e-12)
    assert float(true.thruster.gain) == values["plant.thruster.gain"]
    assert float(true.thruster.thruster.gain[2]) == values["plant.thruster.thruster.gain[2]"]
    nominal = build(read(campaign_trials.scenario.folder / "scenario.yaml")).closed_loop.controller.model
    np.testing.assert_array_equal(plant.controller.model.dynamics.body.mass_matrix, nominal.dynamics.body.mass_matrix)
    np.testing.assert_array_equal(plant.controller.model.actuators.gain, nominal.actuators.gain)


@pytest.mark.full
def test_trials_have_the_bits_of_single_runs(files):
    path = files(trials=9)
    assert typed(path, path.parent / "out").wait(300) == 0
    results = load(path.parent / "out")
    assert json.dumps(list(results.campaign.vary)) == json.dumps(list(KEYS))
    campaign_trials = trials(*read_campaign(path))
    for row in (0, 4, 8):
        data = from_data(campaign_trials.data(row))._replace(folder=path.parent)
        run = run_scenario(data)
        for name in ("position_rms", "energy"):
            assert float(results.rows.sel(trial=row)[name]) == run.steady[name]


MISTAKES = {
    "no vehicle file": (
        {"scenario": SCENARIO.replace("rov.yaml", "bluerov2_heavy")},
        "`vary.plant.vehicle` must be of a scenario with a vehicle file, which has deviations, but is bluerov2_heavy",
    ),
    "no deviations": (
        {"section": ""},
        "`vary.plant.vehicle` must be of a vehicle file with deviations, but is rov.yaml, which has none",
    ),
    "another key": (
        {"vary": "{plant.thruster: {deviations: file}}"},
        "`vary.plant.thruster` must be of `plant.vehicle` where it has `deviations`",
    ),
    "no place for a gain": (
        {"scenario": SCENARIO.replace(f"{{kind: adjusted, gain: 0.93, thruster: {INNER}}}", "t200")},
        "`plant.thruster` must be `adjusted`, because the vehicle file has a deviation of `thruster_gain`",
    ),
    "a key besides": (
        {"vary": "{plant.vehicle: {deviations: file}, plant.vehicle.mass: {uniform: [12, 14]}}"},
        "`plant.vehicle.mass` must not be given together with plant.vehicle, which contains it",
    ),
    "another word": ({"vary": "{plant.vehicle: {deviations: mine}}"}, "`vary.plant.vehicle.deviations` must be"),
    "two correlations": (
        {"correlation": "{keys: [plant.vehicle, loop.dt], rows: [[1], [0, 1]]}"},
        "`correlation.keys[0]` must have numbers in order: not a choice, but is plant.vehicle",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_cannot_be_is_one_line(files, mistake):
    settings, message = MISTAKES[mistake]
    with pytest.raises(BadInput) as error:
        trials(*read_campaign(files(**settings)))
    file = "scenario" if mistake == "no place for a gain" else "campaign"
    assert str(error.value).startswith(message) and f"({file}.yaml, line" in str(error.value)


@pytest.mark.parametrize(
    "given, law",
    [
        ({"log_normal": [2.0, 0.3]}, stats.lognorm(0.3, scale=2.0)),
        ({"cut_normal": [1.0, 2.0, -9.0]}, stats.norm(1.0, 2.0)),
    ],
)
def test_values_are_quantiles(given, law):
    shares = np.array([0.001, 0.1, 0.5, 0.99])
    assert quantiles(Distribution.model_validate(given), shares) == pytest.approx(law.ppf(shares), rel=1e-12)
    assert quantiles(Distribution.model_validate({"cut_normal": [0.0, 1.0, 0.5]}), shares)[:3] == [0.5] * 3


@pytest.mark.parametrize("design", ["random", "latin", "sobol"])
def test_keys_of_any_distribution_are_correlated(campaign, design):
    """The rank correlation of two uniform keys is that of the normal numbers: 6 / pi asin(rho / 2)."""
    vary = {
        "loop.duration": {"uniform": [1, 2]},
        "plant.limit": {"log_uniform": [1, 3]},
        "loop.dt": {"uniform": [1, 2]},
    }
    correlation = {"keys": ["loop.dt", "loop.duration"], "rows": [[1], [-0.7, 1]]}
    asked = validate(from_data(campaign(design=design, trials=4096, vary=vary, correlation=correlation)))
    points = Samples(asked).points(np.arange(4096))
    assert stats.kstest(points[:, 0], "uniform").pvalue > 1e-3 and stats.kstest(points[:, 2], "uniform").pvalue > 1e-3
    found = np.asarray(stats.spearmanr(points)[0])
    assert found[0, 2] == pytest.approx(-6 / np.pi * np.arcsin(0.35), abs=0.05)
    np.testing.assert_allclose(found[1, [0, 2]], 0.0, atol=0.07)


@pytest.mark.parametrize(
    "correlation, message",
    [
        (
            {"keys": ["loop.duration", "loop.dt"], "rows": [[1], [0, 1]]},
            r"`correlation.keys\[1\]` must be a key of `vary`",
        ),
        (
            {"keys": ["loop.duration", "plant.limit"], "rows": [[1]]},
            "`correlation.rows` must be 2 rows of 1 to 2 numbers",
        ),
        ({"keys": ["loop.duration", "plant.limit"], "rows": [[1], [2, 1]]}, "must hold numbers from -1 to 1"),
    ],
)
def test_a_correlation_that_cannot_be_is_one_line(campaign, correlation, message):
    vary = {"loop.duration": {"uniform": [1, 2]}, "plant.limit": {"uniform": [0, 1]}}
    with pytest.raises(BadInput, match=message):
        validate(from_data(campaign(vary=vary, correlation=correlation)))


def test_the_square_root_of_a_singular_correlation():
    """Three numbers of which the third is half the sum of the others, scaled."""
    rows = np.array([[1, 0, np.sqrt(0.5)], [0, 1, np.sqrt(0.5)], [np.sqrt(0.5), np.sqrt(0.5), 1]])
    factor = square_root(rows)
    np.testing.assert_allclose(factor @ factor.T, rows, atol=1e-12)
    assert np.array_equal(factor, np.tril(factor)) and factor[2, 2] == 0.0
