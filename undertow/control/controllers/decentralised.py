"""Decentralised control: a law for each subsystem of a plant, which sees nothing of the others."""

from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, PyTree

from undertow.control.controllers.presets.robust import robust
from undertow.core.composite_model import composite_model, parts_of, split, split_measurement, split_target
from undertow.core.contracts import AbstractController, Inputs, Measurement, Model, Outputs, Target
from undertow.core.errors import BadInput
from undertow.core.signals import Signal

# Dimensions of signals that run over outputs or inputs: there the signals of all laws stand one after the other.
_JOINED = ("axis", "actuator")

# How the numbers of all laws become one; the largest counts where nothing else is said.
_REDUCED = {
    "attained_share": jnp.min,
    "weights_at_bound": jnp.mean,
    "lyapunov_tracking": jnp.sum,
    "lyapunov_decay": jnp.sum,
}


class Decentralised(AbstractController):
    """u_i = law_i(y_i, r_i): states, measurements and references are those of the subsystem alone.

    All laws have the same signals. Those over axes or actuators are joined; numbers become one (parts of the Lyapunov
    function their sum, the attained share the least, the share of weights at their bound the mean, others the
    largest); what else there is gets a dimension `subsystem`.
    """

    model: Model
    laws: tuple[AbstractController, ...]

    def init(self, y: Measurement, r: Target) -> tuple[PyTree, ...]:
        return tuple(law.init(measurement, target) for law, measurement, target in self._each(y, r))

    def command(self, z: tuple[PyTree, ...], y: Measurement, r: Target):
        subsystems = zip(z, self._each(y, r), strict=True)
        commands = [law.command(state, measurement, target) for state, (law, measurement, target) in subsystems]
        signals = {name: self._joined(name, [values[name] for _, values in commands]) for name in self._declared()}
        return jnp.concatenate([u for u, _ in commands]), signals

    def advance(self, z: tuple[PyTree, ...], y: Measurement, r: Target, u_applied: Inputs, dt) -> tuple[PyTree, ...]:
        subsystems = zip(z, self._each(y, r), split(u_applied, self._inputs()), strict=True)
        return tuple(
            law.advance(state, measurement, target, u, dt) for state, (law, measurement, target), u in subsystems
        )

    def known_acceleration(self, z: tuple[PyTree, ...], y: Measurement, u_applied: Inputs) -> Outputs:
        subsystems = zip(self.laws, z, self._measured(y), split(u_applied, self._inputs()), strict=True)
        return jnp.concatenate(
            [law.known_acceleration(state, measurement, u) for law, state, measurement, u in subsystems]
        )

    def signals(self):
        joined = lambda signal: not signal.dimensions or signal.dimensions[0] in _JOINED
        of_subsystems = lambda signal: signal._replace(dimensions=("subsystem", *signal.dimensions))
        declared = self._declared()
        return {name: signal if joined(signal) else of_subsystems(signal) for name, signal in declared.items()}

    def _declared(self) -> dict[str, Signal]:
        return self.laws[0].signals()

    def _joined(self, name: str, values: list[Array]) -> Array:
        dimensions = self._declared()[name].dimensions
        if dimensions and dimensions[0] in _JOINED:
            return jnp.concatenate(values)
        return jnp.stack(values) if dimensions else _REDUCED.get(name, jnp.max)(jnp.stack(values))

    def _inputs(self) -> tuple[int, ...]:
        return parts_of(self.model)[1]

    def _measured(self, y: Measurement) -> tuple[Measurement, ...]:
        return split_measurement(self._coordinates(), y)

    def _each(self, y: Measurement, r: Target) -> list[tuple[Any, Measurement, Target]]:
        return list(zip(self.laws, self._measured(y), split_target(self._coordinates(), r), strict=True))

    def _coordinates(self):
        return tuple(law.model.coordinates for law in self.laws)


def decentralised(
    model: Model, law: Callable[[Model], AbstractController] | Sequence[AbstractController] = robust
) -> Decentralised:
    """The same law for each subsystem of a plant such as `two_vehicles`, with the nominal model of that alone.

    Args:
        model: nominal model, from `plant.model()`.
        law: the law of each, by name with its options. From Python: what makes one for a model, or one for each.

    Raises:
        BadInput: another number of laws than of subsystems.
    """
    parts, inputs = parts_of(model)
    laws = tuple(map(law, parts)) if callable(law) else tuple(law)
    if len(laws) != len(parts):
        raise BadInput("law", f"be one for each of the {len(parts)} subsystems", f"{len(laws)} laws")
    models = tuple(subsystem_law.model for subsystem_law in laws)
    nominal_model = composite_model(models, inputs) if len(parts) > 1 else models[0]
    return Decentralised(nominal_model, laws)
