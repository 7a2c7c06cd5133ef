"""Each dive predicted from the others, and dives that were not used from all."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.scenario.parameter_sets import published_plants
from undertow.scenario.vehicle_parameters import is_outside
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.estimates import Estimates
from undertow.studies.identification.fit import Fit
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import IdentificationModel, model_of
from undertow.studies.identification.validation import PredictionErrors, prediction_errors

_PARTS = 4  # into which a single dive is divided
_PART_OF = ", part "  # between the name of a dive and the number of a part


class Validation(NamedTuple):
    """A dive, or a part of one, that was left out and predicted.

    Attributes:
        dive: left out.
        identified: errors of the model from the other dives.
        prior: errors of the vehicle file.
        is_unseen: whether no estimate used it, not even that of the intervals.
        published: errors of the published parameter sets of the vehicle, by name.
    """

    dive: Dive
    identified: PredictionErrors
    prior: PredictionErrors
    is_unseen: bool = False
    published: Mapping[str, PredictionErrors] = MappingProxyType({})

    @property
    def name(self) -> str:
        """Of the dive."""
        return self.dive.name


def pieces_of(dives: Sequence[Dive]) -> list[Dive]:
    """What is left out in turn: each dive, or a part of the only one."""
    return list(dives) if len(dives) > 1 else parts_of(dives[0], _PARTS)


def cross_validated(
    model: IdentificationModel, pieces: Sequence[Dive], estimate: Fit, count: int, estimates: Estimates
):
    """Estimates without each piece, and how these predict it.

    Without a dive an estimate begins anew: where there are several minima, that of all dives would lead it to one that
    the others alone might not find. Parts of one dive are alike, and begin at the estimate from all of it.
    """
    one_dive = len({piece.name.partition(_PART_OF)[0] for piece in pieces}) == 1
    begin, near = estimate.z[:count], estimate
    left_out, validation = [], []
    for number, piece in enumerate(pieces):
        others = [other for i, other in enumerate(pieces) if i != number]
        if not one_dive:
            begin, near = estimates.nearest_begin(others), None
        without = estimates.of(f"without {Path(piece.name).name}", others, begin, near).z[:count]
        left_out.append(without)
        identified = prediction_errors(model, without, piece)
        validation.append(Validation(piece, identified, prediction_errors(model, np.zeros(count), piece)))
    return np.stack(left_out), tuple(validation)


def predicted(model, z: np.ndarray, dive: Dive) -> Validation:
    """How the estimate from all dives predicts another one."""
    prior = prediction_errors(model, np.zeros(len(z)), dive)
    return Validation(dive, prediction_errors(model, z, dive), prior, is_unseen=True)


def with_published(
    validation: Sequence[Validation], built: Built, parameters: Sequence[FreeParameter]
) -> tuple[Validation, ...]:
    """The same, with how the published parameter sets of the vehicle predict each dive.

    Args:
        validation: see there.
        built: scenario of the vehicle.
        parameters: that are free, of which those of the thrusters have the numbers of the prior for every set.
    """
    of_thrusters = [parameter for parameter in parameters if is_outside(parameter.name)]
    models = {
        name: model_of(prior_vehicle(plant), of_thrusters)
        for name, plant in published_plants(built).items()
        if isinstance(plant, HybridVehicle)
    }
    at_prior = np.zeros(len(of_thrusters))
    return tuple(
        one._replace(published={name: prediction_errors(model, at_prior, one.dive) for name, model in models.items()})
        for one in validation
    )


def parts_of(dive: Dive, number: int) -> list[Dive]:
    """A dive divided into equal parts."""
    length = len(dive.inputs) // number
    return [dive.part(f"{dive.name}{_PART_OF}{i + 1} of {number}", i * length, length) for i in range(number)]


def with_nuisances(parts: np.ndarray | None, z: np.ndarray, count: int) -> np.ndarray | None:
    """Estimates of the parts, with the nuisances of the whole."""
    if parts is None:
        return None
    return np.hstack([parts, np.broadcast_to(z[count:], (len(parts), len(z) - count))])
