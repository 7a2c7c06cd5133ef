"""The closed loop of a scenario as a system to export, with inputs for what somebody changes while it runs.

It is the scenario itself with further parts that begin at a time which is an input: the loss of each thruster, and a
payload that is picked up. Before that time they do nothing, to the last bit. What a visitor sets is thus a scenario,
too, but for the steering, which is added to the reference.
"""

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.supervision.supervised_controller import unsupervised
from undertow.core.arrays import in_present_precision
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import COMPACT_METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.outside.export.c_program import System, made_from
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built, build
from undertow.scenario.changed_values import put_value
from undertow.scenario.reading import from_data
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.recording import instant
from undertow.simulation.loop.simd_batch import realized_disturbance

NEVER = 1e9  # s, the time of what does not happen

# Signals of the loop that the page shows, where the scenario has them.
_SHOWN = ("position", "reference", "error", "acting_input", "power", "estimate", "uncertainty")
_SHOWN += ("lost_thrusters", "supervisor_state")


class Dial(NamedTuple):
    """A number of the scenario that a visitor changes.

    Attributes:
        label: for the page.
        unit: of the values.
        shown: value of each position, as the page writes it.
        base: position of the scenario as it is.
        tables: number of an array of the loop -> the array at each position.
    """

    label: str
    unit: str
    shown: list[float]
    base: int
    tables: dict[int, list[np.ndarray]]


class Switch(NamedTuple):
    """Something that begins at a time, an array of the loop that is `NEVER` until then.

    Attributes:
        label: for the page.
        leaf: number of the array.
        thruster: of a thruster, from 0; None for what is not one.
    """

    label: str
    leaf: int
    thruster: int | None


class LoopInput(NamedTuple):
    """Input of a step: arrays that dials and switches change, number of the step, and what steering adds."""

    numbers: tuple[Any, ...]
    k: Any
    steered: Target


class LoopState(NamedTuple):
    """What the seed realizes of navigation and faults, and what changes from step to step."""

    realized: tuple[Any, ...]
    carry: tuple[Any, ...]


class LiveLoop(NamedTuple):
    """A closed loop for a page.

    Attributes:
        built: the scenario with the parts that begin later.
        dials, switches: what a visitor changes.
        leaves: numbers of the arrays of the loop that are inputs, in the order of `LoopInput.numbers`.
        system: what is exported.
    """

    built: Built
    dials: list[Dial]
    switches: list[Switch]
    leaves: list[int]
    system: System


class _Steered(AbstractReference):
    """A reference with something added to it."""

    inner: AbstractReference
    steered: Target

    def at(self, t) -> Target:
        return Target(*(one + other for one, other in zip(self.inner.at(t), self.steered, strict=True)))


def live_loop(source: Mapping[str, Any]) -> LiveLoop:
    """The closed loop of a scenario for a page, in the present precision, which is that of the scenario.

    Args:
        source: data of the scenario.

    Raises:
        BadInput: the scenario is wrong, or none of a vehicle with thrusters in the sampled loop.
    """
    data = copy.deepcopy(dict(source))
    plain = build(data)
    plant, settings = plain.closed_loop.plant, plain.scenario.loop
    if not isinstance(plant, HybridVehicle):
        raise BadInput("plant", "be a vehicle with thrusters for --wasm", type(plant).__name__)
    if settings.kind != "sampled" or settings.method not in COMPACT_METHODS:
        must = f"be the sampled loop with {' or '.join(COMPACT_METHODS)} for --wasm"
        raise BadInput("loop", must, f"{settings.kind}, {settings.method}")
    data, places = _with_switches(data, plant.inputs())
    built = build(data)
    base = _numbers_of(built)
    switches = [Switch(label, _leaf_of(data, key, base), thruster) for label, key, thruster in places]
    dials = _dials(data, built, base)
    leaves = sorted({switch.leaf for switch in switches} | {leaf for dial in dials for leaf in dial.tables})
    return LiveLoop(built, dials, switches, leaves, _system(built, base, leaves))


def _with_switches(data: dict[str, Any], thrusters: int) -> tuple[dict[str, Any], list[tuple[str, str, int | None]]]:
    """The scenario with parts that begin at `NEVER`, and of each its label, the key of its time, and the thruster."""
    faults = list(data.get("faults") or [])
    given = data.get("disturbance") or []
    loads = list(given) if isinstance(given, list) else [given]
    places: list[tuple[str, str, int | None]] = []
    for number in range(thrusters):
        places.append((f"thruster {number + 1}", f"faults.{len(faults)}.onset", number))
        faults.append({"target": f"thruster {number + 1}", "mode": "off", "onset": NEVER})
    places.append(("payload of 2 kg", f"disturbance.{len(loads)}.start", None))
    loads.append({"kind": "payload", "start": NEVER, "stop": 2 * NEVER})
    return data | {"faults": faults, "disturbance": loads}, places


def _numbers_of(built: Built) -> list[np.ndarray]:
    """The arrays of the loop, and behind them those that its seed realizes of the disturbance.

    The latter are made as a simulation makes them, because the C code would round them in another way.
    """
    loop = in_present_precision(built.closed_loop)
    random = realized_disturbance(loop, key_of_seed(built.scenario.seed))
    return [np.asarray(leaf) for leaf in (*jax.tree.leaves(eqx.filter(loop, eqx.is_array)), *jax.tree.leaves(random))]


def _changed(data: Mapping[str, Any], key: str, value: Any) -> Built:
    changed = copy.deepcopy(dict(data))
    put_value(changed, key, value)
    return build(from_data(changed))


def _leaf_of(data: Mapping[str, Any], key: str, base: list[np.ndarray]) -> int:
    """The array of the loop that holds a time of the scenario."""
    other = _numbers_of(_changed(data, key, NEVER / 2))
    (leaf,) = (i for i, (one, two) in enumerate(zip(base, other, strict=True)) if not np.array_equal(one, two))
    return leaf


def _dials(data: Mapping[str, Any], built: Built, base: list[np.ndarray]) -> list[Dial]:
    """Sea state and gain, where the scenario has them: complete arrays at each position, so that rules are kept."""
    current = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)
    waves = (0.01, *current[1:])  # a height of zero is no wave
    gain = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
    wanted: list[tuple[str, str, str, Any, tuple[float, ...]]] = []
    for number, part in enumerate(data["disturbance"]):
        if part.get("kind") == "current":
            wanted.append(("current", "m/s", f"disturbance.{number}.velocity", part["velocity"], current))
        if part.get("kind") == "waves":
            wanted.append(("wave height", "m", f"disturbance.{number}.height", part["height"], waves))
    if "bandwidth" in built.resolved["controller"]:
        bandwidth = built.resolved["controller"]["bandwidth"] or _bandwidth_of_rule(built.closed_loop)
        if bandwidth is not None:
            wanted.append(("bandwidth of the controller", "rad/s", "controller.bandwidth", bandwidth, gain))
    dials, taken = [], set()
    for label, unit, key, value, factors in wanted:
        tables = _tables(data, key, value, factors, base)
        if tables is not None and not taken & set(tables):
            sizes = np.asarray(value, dtype=float)
            size = float(np.linalg.norm(sizes) if label == "current" else sizes.max())
            shown = [round(factor * size, 4) for factor in factors]
            dials.append(Dial(label, unit, shown, factors.index(1.0), tables))
            taken |= set(tables)
    return dials


def _bandwidth_of_rule(loop: ClosedLoop) -> list[float] | None:
    """The bandwidth that a rule has chosen, of each axis, rad/s; None for a law that does not keep it."""
    law = unsupervised(loop.controller)
    holder = getattr(law, "estimator", law)
    bandwidth = getattr(holder, "bandwidth", None)
    return None if bandwidth is None else np.asarray(bandwidth, dtype=float).tolist()


def _tables(
    data: Mapping[str, Any], key: str, value: Any, factors: tuple[float, ...], base: list[np.ndarray]
) -> dict[int, list[np.ndarray]] | None:
    """Arrays that a value decides, at each multiple of it; None where one of these gives a loop of another structure."""
    positions = []
    for factor in factors:
        scaled = (np.asarray(value, dtype=float) * factor).tolist()
        try:
            arrays = base if factor == 1.0 else _numbers_of(_changed(data, key, scaled))
        except BadInput:
            return None
        if [leaf.shape for leaf in arrays] != [leaf.shape for leaf in base]:
            return None
        positions.append(arrays)
    changed = [i for i, leaf in enumerate(base) if any(not np.array_equal(at[i], leaf) for at in positions)]
    return {i: [at[i] for at in positions] for i in changed}


def _system(built: Built, base: list[np.ndarray], leaves: list[int]) -> System:
    settings, initial = built.scenario.loop, built.scenario.initial
    loop = in_present_precision(built.closed_loop)
    arrays, static = eqx.partition(loop, eqx.is_array)
    form_of_loop = jax.tree.structure(arrays)
    key, dt = key_of_seed(built.scenario.seed), jnp.asarray(settings.dt, dtype=float)
    start = loop.outputs_at_start(initial.position, initial.velocity)
    integrate = COMPACT_METHODS[settings.method]
    zero = np.zeros(len(loop.plant.outputs), dtype=dt.dtype)
    numbers = tuple(np.asarray(base[leaf]) for leaf in leaves)
    example = LoopInput(numbers, np.zeros((), dtype=np.int32), Target(zero, zero, zero))

    form_of_random = jax.tree.structure(jax.eval_shape(loop.disturbance.realize, key))

    def parts_of(inputs: LoopInput) -> tuple[ClosedLoop, Any]:
        """The loop, and what is random of its disturbance."""
        changed = [jnp.asarray(leaf) for leaf in base]
        for leaf, number in zip(leaves, inputs.numbers, strict=True):
            changed[leaf] = number
        count = form_of_loop.num_leaves
        ready = eqx.combine(jax.tree.unflatten(form_of_loop, changed[:count]), static).starting_at(initial.position)
        steered = dataclasses.replace(ready, reference=_Steered(ready.reference, inputs.steered))
        return steered, jax.tree.unflatten(form_of_random, changed[count:])

    def begun(inputs: LoopInput) -> tuple[Any, Any]:
        steered, random = parts_of(inputs)
        realization = steered.realized_with(random, key)
        return realization[2:], sampled.begin(realization, start, ())

    def shown(realization: Realization, carry: Any, k: Any) -> dict[str, Any]:
        (x, z, measuring), _, ending = carry
        t, plant = instant(k, dt), realization.loop.plant
        decision = realization.decide(t, x, z, measuring)
        signals = realization.signals(t, x, z, decision)
        water = realization.load(t, x).water
        return {name: jnp.asarray(signals[name], dtype=float) for name in _SHOWN if name in signals} | {
            "thrust": plant.thruster.thrust(x.thrusters, decision.acting) + jnp.zeros(plant.inputs()),
            "attitude": x.attitude,
            "water": jnp.zeros(3) if water is None else water.velocity,
            "status": ending[0],
        }

    shapes = jax.eval_shape(begun, example)
    forms = [jax.tree.structure(part) for part in shapes]
    flat = lambda parts: LoopState(*(tuple(jax.tree.leaves(part)) for part in parts))

    def first(inputs: LoopInput):
        realized, carry = begun(inputs)
        realization = Realization(*parts_of(inputs), *realized)
        blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), jax.eval_shape(shown, realization, carry, 0))
        return flat((realized, carry)), blank

    def step(state: LoopState, inputs: LoopInput):
        realized, carry = (jax.tree.unflatten(form, part) for form, part in zip(forms, state, strict=True))
        realization = Realization(*parts_of(inputs), *realized)
        output = shown(realization, carry, inputs.k)
        after = sampled.control_step(realization, (), dt, integrate, settings.substeps, carry, inputs.k)
        return flat((realized, after)), output

    meanings = {
        "state": "State of the loop; keep it between the steps.",
        "input": "Input of a step: numbers that may change, number of the step, and what steering adds to the target.",
        "output": "Signals at the beginning of the step.",
        "start": "Sets the state; the output is zero.",
        "step": "Records the loop at step input->k, and takes that step.",
    }
    about = made_from("Closed loop", built.scenario.description)
    sample = lambda _, k: example._replace(k=np.asarray(max(k - 1, 0), dtype=np.int32))
    return System("loop", about, meanings, first, step, example, sample, settings.dt)
