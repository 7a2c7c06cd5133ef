"""A study that varies the plant does not tell the controller."""

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.studies.campaign.campaign_schema import Campaign
from undertow.studies.campaign.trials import trials
from undertow.studies.campaign.varied_scenario import nominal_model_sentence, varied_scenario
from undertow.studies.falsification.box import scenario_at

PLANT = {"kind": "inverted_pendulum"}
SCENARIO = {"plant": PLANT, "controller": "pid", "reference": {"kind": "setpoint", "position": [0.1]}}


@pytest.mark.parametrize(
    "values, told",
    [
        ({"plant.cart_mass": 2.0}, PLANT),
        ({"plant.vehicle.r_g": [0.0, 0.0, 0.01]}, PLANT),
        ({"plant.vehicle.parameters": "wu2018"}, PLANT),
        ({"plant.cart_mass": 2.0, "plant.thruster.fidelity": "static"}, PLANT | {"thruster": {"fidelity": "static"}}),
        ({"plant.thruster.fidelity": "static"}, None),
        ({"plant.ledger": True}, None),
        ({"plant": {"kind": "two_link_arm"}}, None),
        ({"controller.frequency": 2.0, "initial.position[0]": 1.0}, None),
    ],
)
def test_numbers_and_parameter_sets_of_the_plant_are_not_told_but_parts_are(values, told):
    data = SCENARIO | {"initial": {"position": [0.0]}}
    varied = varied_scenario(data, values)
    assert varied.get("model", {}).get("plant") == told
    assert (nominal_model_sentence(data, values) == "") == (told is None)
    assert data == SCENARIO | {"initial": {"position": [0.0]}}


@pytest.mark.parametrize("model", [{"follow": True}, {"plant": {"kind": "inverted_pendulum", "pole_mass": 0.3}}])
def test_a_model_of_the_scenario_stays(model):
    varied = varied_scenario(SCENARIO | {"model": model}, {"plant.cart_mass": 2.0})
    assert varied["model"] == model


def masses(built):
    """Mass of the cart, kg, in the simulated plant and in the nominal model."""
    loop = built.closed_loop
    return float(loop.plant.cart_pole.cart_mass), float(loop.controller.model.dynamics.cart_mass)


def campaign_of(model, **changes):
    campaign = Campaign.model_validate({"scenario": SCENARIO | {"model": model}, "trials": 3} | changes)
    return trials(campaign, from_data({"scenario": campaign.scenario}))


SPREAD = {"plant.cart_mass": {"uniform": [0.5, 2.0]}}


def test_the_controller_is_told_the_nominal_plant_in_every_trial():
    true, known = np.array([masses(build(from_data(campaign_of({}, vary=SPREAD).data(i)))) for i in range(3)]).T
    nominal, _ = masses(build(from_data(SCENARIO)))
    assert len(set(true)) == 3
    assert np.all(known == nominal)


def test_the_nominal_model_follows_where_the_scenario_asks_for_it():
    several = campaign_of({"follow": True}, vary=SPREAD)
    true, known = np.array([masses(build(from_data(several.data(i)))) for i in range(3)]).T
    assert np.array_equal(true, known) and "knows the plant of each trial" in several.nominal_model()


def test_a_sweep_is_not_told_but_a_variant_is():
    swept = campaign_of({}, cross={"plant.cart_mass": [2.0]}, trials=1)
    variants = campaign_of({}, variants={"heavy": {"plant.cart_mass": 2.0}}, trials=1)
    nominal, _ = masses(build(from_data(SCENARIO)))
    assert masses(build(from_data(swept.data(0)))) == (2.0, nominal)
    assert masses(build(from_data(variants.data(0)))) == (2.0, 2.0) and variants.nominal_model() == ""


def test_falsification_does_not_tell_the_controller():
    true, known = masses(build(scenario_at(from_data(SCENARIO), {"plant.cart_mass": 2.0})))
    assert true == 2.0 != known


def test_a_trial_is_repeated_from_its_resolved_scenario():
    built = build(from_data(campaign_of({}, vary=SPREAD).data(1)))
    assert masses(build(from_data(built.resolved))) == masses(built)


def test_another_number_of_inputs_is_refused_with_the_remedy():
    data = {
        "plant": {"kind": "double_integrator", "axes": 1},
        "reference": {"kind": "setpoint", "position": [0.0, 0.0]},
    }
    with pytest.raises(BadInput, match=r"2 outputs and 2 inputs.*follow: true"):
        build(from_data(varied_scenario(data, {"plant.axes": 2})))
