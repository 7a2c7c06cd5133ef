"""Plant, controller and closed loop of a scenario as `NonlinearIOSystem`s of python-control."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import control as ct
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from undertow.core import checks, runtime
from undertow.core.checks import numbers
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.outside.python_control.signals import (
    Units,
    signals_of,
    state_names,
    target_of,
    tree_of,
    vector_of,
    vector_of_measurement,
)
from undertow.scenario.build import Built, build
from undertow.scenario.reading import from_data, read
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop, MeasurementState, Realization
from undertow.simulation.loop.outcome import running
from undertow.simulation.loop.plant_step import PlantState, hold
from undertow.simulation.loop.recording import instant
from undertow.simulation.loop.stepped import compile_step

Scenario = str | Path | Mapping[str, Any] | Built

_ON_TIME = 1e-6  # share of a sampling time by which an instant may miss a multiple of it


class _Held(AbstractReference):
    """A reference that somebody else gives at every step."""

    target: Target

    def at(self, t) -> Target:
        return self.target


def plant(scenario: Scenario, *, sampled: bool = False) -> ct.NonlinearIOSystem:
    """The plant of a scenario in the load that its disturbance puts on it.

    Args:
        scenario: a .yaml file or an earlier run.nc, the same as a mapping, or built.
        sampled: False for continuous time, with what is measured without error as outputs; True for the sampling time,
            with the input held and the measurement of the scenario's navigation as outputs.

    Returns:
        The system; its inputs `applied_1`, ... are limited as the plant limits them.

    Raises:
        BadInput: the scenario cannot be used.
    """
    built = built_of(scenario)
    return _sampled_plant(built) if sampled else _continuous_plant(built)


def controller(scenario: Scenario) -> ct.NonlinearIOSystem:
    """The controller of a scenario at its sampling time: measurement, reference and applied input in, command out.

    Raises:
        BadInput: the scenario cannot be used, or its loop is continuous.
    """
    built = sampled_of(scenario, "controller")
    with computing(built):
        signals = signals_of(built.closed_loop.plant)
        realization, states = _begun(built)
        z, state_from = vector_of(states[1]), tree_of(states[1])
        dt = jnp.asarray(built.scenario.loop.dt)
        sizes = np.cumsum([len(signals.measured), len(signals.desired)])

        def taken(loop: ClosedLoop, state: Any, u: Any):
            measured, desired, applied = jnp.split(u, sizes)
            return state_from(state), measurement_of(loop, measured), target_of(desired), applied

        def advanced(realization: Realization, t: Any, state: Any, u: Any):
            law = realization.loop.controller
            z, y, r, applied = taken(realization.loop, state, u)
            return vector_of(law.advance(z, y, r, applied, dt))

        def commanded(realization: Realization, t: Any, state: Any, u: Any):
            return realization.loop.controller.command(*taken(realization.loop, state, u)[:3])[0]

        inputs = signals.measured | signals.desired | signals.applied
        names = state_names(states[1], "law")
        return _system("controller", built, realization, (advanced, commanded), z, (inputs, signals.command, names))


def limits(scenario: Scenario) -> ct.NonlinearIOSystem:
    """The limits of the plant's inputs, as they are at the start: what the controller commands in, what is applied out.

    Raises:
        BadInput: as of `controller`.
    """
    built = sampled_of(scenario, "controller")
    with computing(built):
        signals = signals_of(built.closed_loop.plant)
        realization, states = _begun(built)

        def limited(realization: Realization, t: Any, state: Any, u: Any):
            return realization.loop.plant.admissible(states[0], u)

        nothing = lambda realization, t, state, u: state
        return _system(
            "limits", built, realization, (nothing, limited), jnp.zeros(0), (signals.command, signals.applied, [])
        )


def closed_loop(scenario: Scenario) -> ct.NonlinearIOSystem:
    """The closed loop of a scenario at its sampling time: reference in, true outputs and applied input out.

    Its steps are those of `undertow simulate`: from the state of `system.start` the response to `reference` has the
    same bits.

    Raises:
        BadInput: the scenario cannot be used, or its loop is continuous.
    """
    built = sampled_of(scenario, "closed loop")
    with computing(built):
        signals = signals_of(built.closed_loop.plant)
        realization, states = _begun(built)
        settings = built.scenario.loop
        start, state_from = vector_of(states), tree_of(states)
        integrate = METHODS[settings.method]
        dt = jnp.asarray(settings.dt)

        def following(realization: Realization, u: Any) -> Realization:
            loop = eqx.tree_at(lambda loop: loop.reference, realization.loop, _Held(target_of(u)))
            return realization._replace(loop=loop)

        def stepped(realization: Realization, k: Any, state: Any, u: Any):
            carry = (state_from(state), (), running())
            with_reference = following(realization, u)
            return vector_of(sampled.control_step(with_reference, (), dt, integrate, settings.substeps, carry, k)[0])

        def shown(realization: Realization, k: Any, state: Any, u: Any):
            t = instant(k, dt)
            x, z, measuring = state_from(state)
            truth = realization.loop.plant.output(t, x)
            applied = following(realization, u).decide(t, x, z, measuring).applied
            return jnp.concatenate([truth.position, truth.velocity, applied])

        kinematic = dict(list(signals.measured.items())[: 2 * len(built.closed_loop.plant.outputs)])
        prefixed = zip(("plant", "law", "measuring"), states, strict=True)
        names = [name for prefix, tree in prefixed for name in state_names(tree, prefix)]
        system_signals = signals.desired, kinematic | signals.applied, names
        return _system("closed_loop", built, realization, (stepped, shown), start, system_signals, by_number=True)


def connected(
    plant: ct.InputOutputSystem, limits: ct.InputOutputSystem, controller: ct.InputOutputSystem
) -> ct.InputOutputSystem:
    """Plant, limits and controller connected by the names of their signals; inputs are the reference.

    Raises:
        BadInput: their times differ, or one lacks a signal that another needs.
    """
    parts = {"plant": plant, "limits": limits, "controller": controller}
    if not plant.dt:
        hint = "Take `plant(scenario, sampled=True)`"
        raise BadInput("plant", "be in discrete time, as its controller is", "continuous", hint=hint)
    available = {name for part in parts.values() for name in part.output_labels}
    for name, part in parts.items():
        if part.dt != plant.dt:
            raise BadInput(name, f"have the sampling time of the plant, {plant.dt:g} s", f"{part.dt:g} s")
        lacking = [label for label in part.input_labels if label not in available and not label.endswith("_desired")]
        if lacking:
            raise BadInput(name, "take what the others give", f"without {', '.join(lacking)}")
    desired = [name for name in controller.input_labels if name.endswith("_desired")]
    outputs = [*plant.output_labels, *controller.output_labels, *limits.output_labels]
    return ct.interconnect([plant, controller, limits], inputs=desired, outputs=outputs, name="connected")


def reference(scenario: Scenario, time: Any) -> NDArray:
    """The reference of a scenario at instants (s), as inputs of its closed loop: shape (3 n, K).

    Raises:
        BadInput: the scenario cannot be used, or the instants are no list of numbers.
    """
    built = built_of(scenario)
    instants = numbers("time", time, (np.size(time),))
    checks.finite("time", instants, "s")
    with computing(built):
        desired = lambda part, _, t: ((), jnp.concatenate(part.at(t)))
        step = compile_step(desired, built.closed_loop.reference, (), np.zeros(()))
    references = []
    for now in instants:  # by the program of a step, for the bits of a simulation
        step.inputs[...] = now
        step()
        references.append(step.outputs.copy())
    return np.array(references).T


def built_of(scenario: Scenario) -> Built:
    """A scenario, built."""
    if isinstance(scenario, Built):
        return scenario
    return build(from_data(scenario) if isinstance(scenario, Mapping) else read(Path(scenario)))


def sampled_of(scenario: Scenario, what: str) -> Built:
    """A scenario with a sampled loop, built."""
    built = built_of(scenario)
    if built.scenario.loop.kind != "sampled":
        raise BadInput("loop.kind", f"be sampled for a {what} in discrete time", built.scenario.loop.kind)
    return built


def measurement_of(loop: ClosedLoop, vector: Any):
    """A measurement for the law from its numbers in the order of `Signals.measured`."""
    n = len(loop.plant.outputs)
    report = loop.plant.output(jnp.zeros(()), loop.plant.initial_state()).actuator
    actuator = tree_of(report)(vector[2 * n :])
    return loop.controller.model.coordinates.measurement(vector[:n], vector[n : 2 * n], actuator)


def _continuous_plant(built: Built) -> ct.NonlinearIOSystem:
    with computing(built):
        signals = signals_of(built.closed_loop.plant)
        realization, states = _begun(built)
        x, state_from = vector_of(states[0]), tree_of(states[0])

        def moved(realization: Realization, t: Any, state: Any, u: Any):
            x = state_from(state)
            return vector_of(realization.motion(t, x, realization.loop.plant.admissible(x, u)))

        def shown(realization: Realization, t: Any, state: Any, u: Any):
            return vector_of_measurement(realization.loop.plant.output(t, state_from(state)))

        names = state_names(states[0], "plant")
        return _system("plant", built, realization, (moved, shown), x, (signals.applied, signals.measured, names), dt=0)


def _sampled_plant(built: Built) -> ct.NonlinearIOSystem:
    if built.scenario.loop.method == "adaptive":
        raise BadInput("loop.method", "be rk4 or euler for a plant in discrete time", "adaptive")
    with computing(built):
        signals = signals_of(built.closed_loop.plant)
        realization, states = _begun(built)
        settings = built.scenario.loop
        first = PlantState(states[0], states[2].navigation, states[2].faults)
        start, state_from = vector_of(first), tree_of(first)
        integrate = METHODS[settings.method]
        dt = jnp.asarray(settings.dt)

        def measured(realization: Realization, t: Any, state: Any):
            x, navigation, faults = state_from(state)
            truth = realization.loop.plant.output(t, x)
            y, measuring = realization.read(t, truth, MeasurementState(navigation, None, faults))
            return PlantState(x, measuring.navigation, measuring.faults), y

        def stepped(realization: Realization, t: Any, state: Any, u: Any):
            before, _ = measured(realization, t, state)
            applied = realization.loop.plant.admissible(before.plant, u)
            return vector_of(hold(realization, before, t, dt, applied, integrate, settings.substeps))

        def shown(realization: Realization, t: Any, state: Any, u: Any):
            return vector_of_measurement(measured(realization, t, state)[1])

        prefixed = zip(("plant", "navigation", "faults"), first, strict=True)
        names = [name for prefix, tree in prefixed for name in state_names(tree, prefix)]
        system_signals = (signals.applied, signals.measured, names)
        return _system("plant", built, realization, (stepped, shown), start, system_signals)


def _system(
    name: str,
    built: Built,
    realization: Realization,
    functions: tuple[Callable, Callable],
    start: Any,
    signals: tuple[Units, Units, list[str]],
    dt: float | None = None,
    by_number: bool = False,
) -> ct.NonlinearIOSystem:
    """A system of compiled functions (realization, t, state, input).

    Args:
        name: of the system.
        built: scenario.
        realization: its loop.
        functions: of the state and of the outputs.
        start: state at t = 0.
        signals: inputs, outputs, names of the states.
        dt: sampling time, s, 0 for continuous time; None for that of the scenario.
        by_number: whether the functions take the number of the step in place of t.
    """
    inputs, outputs, states = signals
    period = built.scenario.loop.dt if dt is None else dt
    instant = jnp.zeros((), dtype=int) if by_number else jnp.zeros(())
    arguments = (instant, start, jnp.zeros(len(inputs)))

    def called(function: Callable) -> Callable:
        step = compile_step(lambda part, _, arguments: ((), function(part, *arguments)), realization, (), arguments)
        at, state, u = step.inputs

        def call(t: float, x: NDArray, input_vector: NDArray, params: Any) -> NDArray:
            at[...] = _number(t, period) if by_number else t
            state[...] = x
            u[...] = input_vector
            step()
            return step.outputs.astype(float)

        return call

    updated, output = map(called, functions)
    system: Any = ct.nlsys(
        updated, output, inputs=list(inputs), outputs=list(outputs), states=states, dt=period or 0, name=name
    )
    system.units = inputs | outputs
    system.start = np.asarray(start, dtype=float)
    return system


def _number(t: float, dt: float) -> int:
    """Number of the step at an instant (s)."""
    number = round(t / dt)
    if abs(t / dt - number) > _ON_TIME:
        raise BadInput("time", f"be whole sampling times of {dt:g} s", f"{t:g} s")
    return number


def _begun(built: Built) -> tuple[Realization, tuple[Any, Any, MeasurementState]]:
    """The loop with its random parts sampled, and the states of plant, law and measuring at t = 0, as in a run."""
    loop = built.closed_loop
    key = key_of_seed(built.scenario.seed)
    start = _start(built)
    sampled_once = lambda loop, key: eqx.filter(loop.realize(key)[1:], eqx.is_array)
    first = lambda loop, key: sampled.begin(loop.realize(key), start, ())[0]
    step = compile_step(lambda loop, _, key: ((), (sampled_once(loop, key), first(loop, key))), loop, (), key)
    step()
    arrays, states = jax.tree.map(jnp.asarray, step.outputs)
    static = eqx.filter(loop.realize(key)[1:], eqx.is_array, inverse=True)
    return Realization(loop, *eqx.combine(arrays, static)), states


def _start(built: Built) -> tuple[Any, Any]:
    initial = built.scenario.initial
    return built.closed_loop.outputs_at_start(initial.position, initial.velocity)


@contextmanager
def computing(built: Built) -> Iterator[None]:
    """Context in which a scenario is computed: on the processor, in its precision."""
    with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
        yield
