"""Random vehicles: samples within the deviations of a vehicle file."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.scenario.correlation import correlated, square_root
from undertow.scenario.uncertain_number import UncertainNumber, log_deviation
from undertow.scenario.vehicle_file import VehicleFile
from undertow.scenario.vehicle_parameters import NOT_NEGATIVE, POSITIVE, sign_of, with_parameters
from undertow.scenario.vehicle_schema import parse

_TRIES = 100  # per vehicle, of which one must be possible


def deviations_of(vehicle_file: VehicleFile) -> dict[str, UncertainNumber]:
    """Parameters of a vehicle file that are not known exactly, by name; {} where all are.

    The inertia is about the origin of the body, as in a `VehicleModel`.
    """
    return {} if vehicle_file.uncertainty is None else dict(vehicle_file.uncertainty.numbers)


def sample(
    vehicle_file: VehicleFile, seed: int | np.random.Generator, count: int
) -> dict[str, Float[np.ndarray, " n"]]:
    """Random vehicles from the distribution of a vehicle file.

    Positive parameters are log-normal with the value as median, others normal; damping and delays are cut at 0. A
    vehicle whose mass matrix is not positive definite is replaced by another one.

    Args:
        vehicle_file: with deviations.
        seed: of the random numbers, or their generator.
        count: number n of vehicles.

    Returns:
        Values of each parameter that has a deviation, by name.

    Raises:
        BadInput: the file has no deviations, or hardly any vehicle within them is possible.
    """
    uncertainty = vehicle_file.uncertainty
    if uncertainty is None:
        hint = "Write numbers such as `13.5 +- 0.2`, or a section `uncertainty`"
        raise BadInput("vehicle", "have deviations", "without", hint=hint)
    generator = np.random.default_rng(seed)
    factor = square_root(uncertainty.correlation)
    names, samples = list(uncertainty.numbers), []
    for _ in range(_TRIES):
        deviates = correlated(generator.standard_normal((count - len(samples), len(names))), factor)
        columns = [from_deviate(name, uncertainty.numbers[name], deviates[:, i]) for i, name in enumerate(names)]
        rows = np.stack(columns, axis=1)
        samples += [row for row in rows if _is_possible(vehicle_file, dict(zip(names, row.tolist(), strict=True)))]
        if len(samples) == count:
            return {name: np.array([row[i] for row in samples]) for i, name in enumerate(names)}
    must = "leave the mass matrix positive definite within its deviations"
    raise BadInput("vehicle", must, f"not so for {_TRIES} samples of a vehicle", hint="Give smaller deviations")


def from_deviate(name: str, number: UncertainNumber, deviate: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Values of a parameter for standard normal numbers."""
    if sign_of(name) == POSITIVE:
        return number.value * np.exp(log_deviation(number) * deviate)
    values = number.value + number.deviation * deviate
    return np.maximum(values, 0.0) if sign_of(name) == NOT_NEGATIVE else values


def _is_possible(vehicle_file: VehicleFile, values: Mapping[str, float]) -> bool:
    """Whether a vehicle with these values has a mass matrix that is positive definite."""
    vehicle = parse(with_parameters(vehicle_file.contents, vehicle_file.data.hull, values))
    mass_matrix = vehicle.facts().mass_matrix
    return bool(np.linalg.eigvalsh((mass_matrix + mass_matrix.T) / 2).min() > 0)
