"""Vary a vehicle within the deviations of its file: one distribution per parameter, with their correlation.

A campaign keeps the distributions, not the file, so that its results can be read and resumed without it.
"""

import numpy as np

from undertow.core.errors import BadInput
from undertow.scenario.correlation import lower_triangle
from undertow.scenario.reading import Text
from undertow.scenario.uncertain_number import UncertainNumber, log_deviation
from undertow.scenario.vehicle_file import vehicle_file_of
from undertow.scenario.vehicle_keys import vehicle_keys
from undertow.scenario.vehicle_parameters import NOT_NEGATIVE, POSITIVE, sign_of
from undertow.scenario.vehicle_uncertainty import VehicleUncertainty
from undertow.studies.campaign.campaign_schema import Campaign, Correlation, Distribution

_VEHICLE = "plant.vehicle"
_NAME = f"vary.{_VEHICLE}"


def with_vehicle_deviations(campaign: Campaign, scenario: Text) -> Campaign:
    """The campaign with a distribution for every parameter of the vehicle file that has a deviation.

    Args:
        campaign: as read; one without `{deviations: file}` stays as it is.
        scenario: that it varies.

    Raises:
        BadInput: the vehicle is none of a file with deviations, or the scenario has no place for a gain of thrusters.
    """
    keys = [key for key, spread in campaign.vary.items() if spread.deviations is not None]
    if not keys:
        return campaign
    if keys != [_VEHICLE]:
        raise BadInput(f"vary.{keys[0]}", f"be of `{_VEHICLE}` where it has `deviations`", keys[0])
    if campaign.correlation is not None:
        raise BadInput("correlation", f"be left out beside the deviations of `{_VEHICLE}`, which have their own")
    uncertainty = _uncertainty(scenario)
    key_of = vehicle_keys(uncertainty.numbers, scenario)
    names = list(key_of)
    vary: dict[str, Distribution] = {}
    for key, spread in campaign.vary.items():
        vary |= {key: spread} if key != _VEHICLE else {key_of[name]: _spread(name, uncertainty) for name in names}
    places = [list(uncertainty.numbers).index(name) for name in names]
    matrix = uncertainty.correlation[np.ix_(places, places)]
    correlation = None
    if np.any(matrix != np.eye(len(names))):
        correlation = Correlation(keys=list(key_of.values()), rows=lower_triangle(matrix))
    return campaign.model_copy(update={"vary": vary, "correlation": correlation})


def _uncertainty(scenario: Text) -> VehicleUncertainty:
    """Deviations in the vehicle file of a scenario."""
    vehicle_file = vehicle_file_of(scenario)
    if vehicle_file is None:
        vehicle = scenario.data.get("plant", {}).get("vehicle", "another vehicle")
        raise BadInput(_NAME, "be of a scenario with a vehicle file, which has deviations", vehicle)
    if vehicle_file.uncertainty is None:
        hint = "Write numbers such as `13.5 +- 0.2` there, or a section `uncertainty`"
        raise BadInput(
            _NAME, "be of a vehicle file with deviations", f"{vehicle_file.text.name}, which has none", hint=hint
        )
    return vehicle_file.uncertainty


def _spread(name: str, uncertainty: VehicleUncertainty) -> Distribution:
    """Distribution of a parameter, as `vehicle_samples` has it."""
    number: UncertainNumber = uncertainty.numbers[name]
    if sign_of(name) == POSITIVE:
        return Distribution.model_validate({"log_normal": [number.value, log_deviation(number)]})
    if sign_of(name) == NOT_NEGATIVE:
        return Distribution.model_validate({"cut_normal": [number.value, number.deviation, 0.0]})
    return Distribution.model_validate({"normal": [number.value, number.deviation]})
