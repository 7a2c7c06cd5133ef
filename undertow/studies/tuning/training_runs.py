"""Training and held-out runs: seeds, sizes of the disturbance, and plant variants beside the nominal model."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractPlant
from undertow.core.errors import BadInput
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built
from undertow.scenario.parameter_sets import parameter_sets, plant_with_set
from undertow.scenario.reading import Text
from undertow.scenario.sampled_plants import sampled_plants
from undertow.scenario.schema import TrainingRuns
from undertow.scenario.vehicle_file import has_deviations

_HELD_OUT_SEEDS = 1_000_000  # far from the training seeds


class PlantVariants(NamedTuple):
    """Runs that differ in what the nominal model does not include; leaves of `plants` have one entry per trial."""

    plants: AbstractPlant
    keys: Array
    sizes: Float[Array, " trials"]
    variants: tuple[str, ...]  # plant variant of each; "" where there is only one

    @property
    def number(self) -> int:
        """Number of trials."""
        return len(self.variants)

    def part(self, chosen: Any) -> "PlantVariants":
        """The trials with the given numbers, which may repeat."""
        pick = lambda tree: jax.tree.map(lambda leaf: leaf[chosen], eqx.filter(tree, eqx.is_array))
        plants = eqx.combine(pick(self.plants), eqx.filter(self.plants, eqx.is_array, inverse=True))
        return PlantVariants(plants, self.keys[chosen], self.sizes[chosen], tuple(self.variants[i] for i in chosen))


def training_and_held_out(text: Text, built: Built) -> tuple[PlantVariants, PlantVariants]:
    """Both sets of trials of a scenario, with different seeds and, where there are several, different parameter sets.

    The nominal model stays the same. Published sets, starting with the nominal one, alternate between the training and
    the held-out set, which also contains the nominal one. A vehicle file with deviations gives other vehicles at random
    to each set.

    Raises:
        BadInput: a parameter set that the vehicle does not have.
    """
    tune, names = built.scenario.tune, parameter_sets(built)
    held_out_sets = tuple(dict.fromkeys((*names[:1], *names[1::2])))
    train = trials(text, built, tune.train, names[::2], "train", built.scenario.seed)
    return train, trials(text, built, tune.held_out, held_out_sets, "held_out", built.scenario.seed + _HELD_OUT_SEEDS)


def trials(
    text: Text, built: Built, runs: TrainingRuns, default: Sequence[str], key: str, first_seed: int
) -> PlantVariants:
    """Every set with every seed; sizes of the disturbance take turns with the seeds.

    Args:
        text: the scenario as read.
        built: the same, built.
        runs: number of seeds, sizes and sets.
        default: sets where none are given.
        key: key of `tune`, for messages.
        first_seed: first seed; the others follow.
    """
    names = tuple(runs.sets if runs.sets is not None else default)
    published = parameter_sets(built)
    for i, name in enumerate(names):
        if not published:
            raise BadInput(f"tune.{key}.sets", "be left out: there is only one parameter set", list(names))
        checks.choice(f"tune.{key}.sets[{i}]", name, published)
    for i, size in enumerate(runs.sizes):
        checks.not_negative(f"tune.{key}.sizes[{i}]", size)
    if not runs.sizes:
        raise BadInput(f"tune.{key}.sizes", "have an entry")
    if has_deviations(text):
        plants = sampled_plants(built, first_seed, runs.vehicles)
    else:
        used = names or published[:1] or ("",)
        plants = {name: plant_with_set(built, name) if name else built.closed_loop.plant for name in used}
    pairs = [(name, seed) for seed in range(runs.seeds) for name in plants]
    return PlantVariants(
        plants=stacked([plants[name] for name, _ in pairs]),
        keys=jnp.stack([key_of_seed((first_seed + seed) % 2**32) for _, seed in pairs]),
        sizes=jnp.asarray([runs.sizes[seed % len(runs.sizes)] for _, seed in pairs], dtype=float),
        variants=tuple(name for name, _ in pairs),
    )


def joined(variant_sets: Sequence[PlantVariants]) -> PlantVariants:
    """All trials of several sets."""
    numbers = [(eqx.filter(variants.plants, eqx.is_array), variants.keys, variants.sizes) for variants in variant_sets]
    arrays, keys, sizes = jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *numbers)
    plants = eqx.combine(arrays, eqx.filter(variant_sets[0].plants, eqx.is_array, inverse=True))
    return PlantVariants(plants, keys, sizes, tuple(name for variants in variant_sets for name in variants.variants))


def stacked(plants: Sequence[AbstractPlant]) -> AbstractPlant:
    """Plants of one kind as one plant with stacked arrays; names and sources are those of the first."""
    numbers = [jax.tree.leaves(eqx.filter(plant, eqx.is_array)) for plant in plants]
    tree = jax.tree.structure(eqx.filter(plants[0], eqx.is_array))
    together = jax.tree.unflatten(tree, [jnp.stack(leaves) for leaves in zip(*numbers, strict=True)])
    return eqx.combine(together, eqx.filter(plants[0], eqx.is_array, inverse=True))
