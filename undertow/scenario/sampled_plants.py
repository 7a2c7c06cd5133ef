"""Plants of a scenario whose vehicle lies within the deviations of its file."""

from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.core.contracts import AbstractPlant
from undertow.scenario import factory
from undertow.scenario.build import Built
from undertow.scenario.changed_values import put_value
from undertow.scenario.vehicle_file import vehicle_file_of
from undertow.scenario.vehicle_keys import vehicle_keys
from undertow.scenario.vehicle_samples import sample

OF_FILE = "the values of the file"  # name of the plant as it is


def sampled_plants(built: Built, seed: int, count: int) -> dict[str, AbstractPlant]:
    """The plant of a scenario, and others at random, by name.

    Args:
        built: scenario with such a file.
        seed: of the random numbers.
        count: number of plants beside that with the values of the file.

    Raises:
        BadInput: no vehicle file with deviations, or no place for a gain or the lag of the thrusters.
    """
    plants = {OF_FILE: built.closed_loop.plant}
    if not count:
        return plants
    vehicle_file = vehicle_file_of(built.text)
    assert vehicle_file is not None  # `has_deviations`
    samples = sample(vehicle_file, seed, count)
    keys = vehicle_keys(samples, built.text)
    for number in range(count):
        values = {key: samples[name][number] for name, key in keys.items()}
        plants[f"vehicle {number + 1}"] = _plant(built, values)
    return plants


def _plant(built: Built, values: dict[str, np.ndarray]) -> AbstractPlant:
    """The plant with other numbers; what is no number stays, so that its programs need not be compiled again."""
    data: dict[str, Any] = {"plant": dict(built.scenario.plant.model_dump())}
    for key, value in values.items():
        put_value(data, key, float(value))
    plant, _ = factory.make("plants", data["plant"], built.text.folder)
    nominal = built.closed_loop.plant
    structure = jax.tree.structure(eqx.filter(nominal, eqx.is_array))
    numbers = jax.tree.unflatten(structure, jax.tree.leaves(eqx.filter(plant, eqx.is_array)))
    return eqx.combine(numbers, eqx.filter(nominal, eqx.is_array, inverse=True))
