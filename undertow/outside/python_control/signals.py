"""Names and units of the signals of a loop, and its states as vectors."""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import AbstractPlant, Measurement, Target

Units = dict[str, str]  # name of a signal -> its unit


class Signals(NamedTuple):
    """Signals between plant and controller, in the order of their vectors.

    Attributes:
        measured: outputs, their rates, and what the actuators report.
        desired: position, rate and acceleration of the reference.
        command, applied: inputs before and after the limits of the plant.
    """

    measured: Units
    desired: Units
    command: Units
    applied: Units


def signals_of(plant: AbstractPlant) -> Signals:
    """Names and units of the signals of a plant and its controller: `north`, `north_rate`, `input_1`, ..."""
    units = dict(zip(plant.outputs, plant.output_units, strict=True))
    with_suffix = lambda suffix, per: {f"{name}_{suffix}": f"{unit}{per}" for name, unit in units.items()}
    report = plant.output(jnp.zeros(()), plant.initial_state()).actuator
    reported = {name: "rad/s^2" if name.startswith("acceleration") else "rad/s" for name in state_names(report)}
    measured = units | with_suffix("rate", "/s") | reported
    desired = (
        with_suffix("desired", "") | with_suffix("rate_desired", "/s") | with_suffix("acceleration_desired", "/s^2")
    )
    inputs = range(1, plant.inputs() + 1)
    per_actuator = lambda name: {f"{name}_{number}": plant.input_unit for number in inputs}
    return Signals(measured, desired, per_actuator("input"), per_actuator("applied"))


def state_names(tree: Any, prefix: str = "") -> list[str]:
    """A name for each number of a state: its place in the tree, and numbers from 1 where there are several."""
    names = []
    for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
        words = [str(getattr(key, "name", getattr(key, "key", getattr(key, "idx", key)))) for key in path]
        name = "_".join([*filter(None, [prefix]), *words]) or "state"
        names += [name] if np.ndim(leaf) == 0 else [f"{name}_{number}" for number in range(1, np.size(leaf) + 1)]
    return names


def vector_of(tree: Any) -> Any:
    """The numbers of a tree in the order of `state_names`."""
    return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(leaf).astype(float) for leaf in jax.tree.leaves(tree))])


def tree_of(like: Any) -> Callable[[Any], Any]:
    """The way back from `vector_of` to trees like one."""
    leaves, form = jax.tree.flatten(like)
    shapes = [np.shape(leaf) for leaf in leaves]
    types = [jnp.asarray(leaf).dtype for leaf in leaves]
    ends = np.cumsum([0, *(np.prod(shape, dtype=int) for shape in shapes)])

    def whole(vector: Any) -> Any:
        parts = [vector[start:end] for start, end in itertools.pairwise(ends)]
        back = [part.reshape(shape).astype(kind) for part, shape, kind in zip(parts, shapes, types, strict=True)]
        return jax.tree.unflatten(form, back)

    return whole


def vector_of_measurement(y: Measurement) -> Any:
    """A measurement in the order of `Signals.measured`."""
    return jnp.concatenate([y.position, y.velocity, vector_of(y.actuator)])


def target_of(vector: Any) -> Target:
    """A target from its numbers in the order of `Signals.desired`."""
    return Target(*jnp.split(vector, 3))
