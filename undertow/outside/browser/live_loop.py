"""The closed loop of a scenario as a system to export, with inputs for what somebody changes while it runs.

It is the scenario itself with further parts that begin at a time which is an input: the loss of each thruster, and a
payload that is picked up. Before that time they do nothing, to the last bit. What a visitor sets is thus a scenario,
too, but for the steering, which is added to the reference.
"""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.arrays import in_present_precision
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import COMPACT_METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.outside.browser.live_numbers import LiveNumbers, live_numbers
from undertow.outside.export.c_program import System, made_from
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.recording import instant

# Signals of the loop that the page shows, where the scenario has them.
_SHOWN = ("position", "reference", "error", "acting_input", "power", "estimate", "uncertainty")
_SHOWN += ("lost_thrusters", "supervisor_state")


class LoopInput(NamedTuple):
    """Input of a step: arrays that sliders and switches change, the start, number of the step, what steering adds.

    The start is no constant, because a simulation computes with it in compiled code, which rounds in its own way.
    """

    numbers: tuple[Any, ...]
    start: tuple[Any, Any]
    k: Any
    steered: Target


class LoopState(NamedTuple):
    """What the seed realizes of navigation and faults, and what changes from step to step."""

    realized: tuple[Any, ...]
    carry: tuple[Any, ...]


class LiveLoop(NamedTuple):
    """A closed loop for a page: what a visitor changes, and what is exported."""

    numbers: LiveNumbers
    system: System


class _Steered(AbstractReference):
    """A reference with something added to it."""

    inner: AbstractReference
    steered: Target

    def at(self, t) -> Target:
        return Target(*(one + other for one, other in zip(self.inner.at(t), self.steered, strict=True)))


def live_loop(built: Built) -> LiveLoop:
    """The closed loop of a scenario for a page, in the present precision, which is that of the scenario.

    Raises:
        BadInput: the scenario is none of a vehicle with thrusters in the sampled loop.
    """
    plant, settings = built.closed_loop.plant, built.scenario.loop
    if not isinstance(plant, HybridVehicle):
        raise BadInput("plant", "be a vehicle with thrusters for --wasm", type(plant).__name__)
    if settings.kind != "sampled" or settings.method not in COMPACT_METHODS:
        must = f"be the sampled loop with {' or '.join(COMPACT_METHODS)} for --wasm"
        raise BadInput("loop", must, f"{settings.kind}, {settings.method}")
    numbers = live_numbers(built.text, plant.inputs())
    return LiveLoop(numbers, _system(numbers))


def _system(numbers: LiveNumbers) -> System:
    base, leaves, scenario = numbers.base, numbers.leaves(), numbers.built.scenario
    settings, initial = scenario.loop, scenario.initial
    loop = in_present_precision(numbers.built.closed_loop).starting_at(initial.position)
    arrays, static = eqx.partition(loop, eqx.is_array)
    form_of_loop = jax.tree.structure(arrays)
    key, dt = key_of_seed(scenario.seed), jnp.asarray(settings.dt, dtype=float)
    form_of_random = jax.tree.structure(jax.eval_shape(loop.disturbance.realize, key))
    start = loop.outputs_at_start(initial.position, initial.velocity)
    integrate = COMPACT_METHODS[settings.method]
    zero = jnp.zeros(len(loop.plant.outputs))
    numbers_at_start = tuple(base[leaf] for leaf in leaves)
    example = LoopInput(numbers_at_start, start, np.zeros((), dtype=np.int32), Target(zero, zero, zero))
    example = jax.tree.map(np.asarray, example)

    def parts_of(arrays: list[Any], inputs: LoopInput) -> tuple[ClosedLoop, Any]:
        """The loop, and what is random of its disturbance."""
        changed = list(arrays)
        for leaf, number in zip(leaves, inputs.numbers, strict=True):
            changed[leaf] = number
        count = form_of_loop.num_leaves
        loop = eqx.combine(jax.tree.unflatten(form_of_loop, changed[:count]), static)
        steered = dataclasses.replace(loop, reference=_Steered(loop.reference, inputs.steered))
        return steered, jax.tree.unflatten(form_of_random, changed[count:])

    def begun(arrays: list[Any], inputs: LoopInput) -> tuple[Any, Any]:
        steered, random = parts_of(arrays, inputs)
        realization = steered.realized_with(random, key)
        return realization[2:], sampled.begin(realization, inputs.start, ())

    forms = [jax.tree.structure(part) for part in jax.eval_shape(begun, base, example)]
    flat = lambda parts: LoopState(*(tuple(jax.tree.leaves(part)) for part in parts))

    # The arrays are arguments of these two, so that only the program computes with them, and rounds as a simulation.
    @jax.jit
    def first(arrays: list[Any], inputs: LoopInput):
        realized, carry = begun(arrays, inputs)
        outputs = jax.eval_shape(_shown, Realization(*parts_of(arrays, inputs), *realized), carry, instant(0, dt))
        return flat((realized, carry)), jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), outputs)

    @jax.jit
    def step(arrays: list[Any], state: LoopState, inputs: LoopInput):
        realized, carry = (jax.tree.unflatten(form, part) for form, part in zip(forms, state, strict=True))
        realization = Realization(*parts_of(arrays, inputs), *realized)
        output = _shown(realization, carry, instant(inputs.k, dt))
        after = sampled.control_step(realization, (), dt, integrate, settings.substeps, carry, inputs.k)
        return flat((realized, after)), output

    meanings = {
        "state": "State of the loop; keep it between the steps.",
        "input": "Input of a step: numbers that may change, number of the step, and what steering adds to the target.",
        "output": "Signals at the beginning of the step.",
        "start": "Sets the state; the output is zero.",
        "step": "Records the loop at step input->k, and takes that step.",
    }
    about = made_from("Closed loop", scenario.description)
    sample = lambda _, k: example._replace(k=np.asarray(max(k - 1, 0), dtype=np.int32))
    start_of = lambda inputs: first(base, inputs)
    step_of = lambda state, inputs: step(base, state, inputs)
    return System("loop", about, meanings, start_of, step_of, example, sample, settings.dt)


def _shown(realization: Realization, carry: Any, t: Any) -> dict[str, Any]:
    """What the page shows of an instant."""
    (x, z, measuring), _, ending = carry
    plant: Any = realization.loop.plant
    decision = realization.decide(t, x, z, measuring)
    signals = realization.signals(t, x, z, decision)
    water = realization.load(t, x).water
    return {name: jnp.asarray(signals[name], dtype=float) for name in _SHOWN if name in signals} | {
        "thrust": plant.thruster.thrust(x.thrusters, decision.acting) + jnp.zeros(plant.inputs()),
        "attitude": x.attitude,
        "water": jnp.zeros(3) if water is None else water.velocity,
        "status": ending[0],
    }
