"""Plant, controller and closed loop of a scenario, linearised exactly, as `StateSpace`s of python-control.

The derivatives are those of automatic differentiation, at the equilibrium that `undertow analyze` uses. Limits, dead
zones and measurement errors are left out, as there: signals are deviations from the equilibrium, inside the limits.

So are states from which no output follows (counters, the energy ledger), and an attitude is three angles in place of a
quaternion, whose length nothing can change: both are poles at the border of stability, with which Riccati equations and
steady gains have no answer.
"""

import dataclasses
from typing import Any

import control as ct
import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearization.equilibrium import Equilibrium, equilibrium
from undertow.core.errors import BadInput
from undertow.outside.python_control.signals import signals_of, state_names, target_of, vector_of, vector_of_measurement
from undertow.outside.python_control.states import StateSpaceMatrices, seen, with_angles
from undertow.outside.python_control.systems import Scenario, built_of, computing, measurement_of, sampled_of
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.studies.prediction.operating_point import operating_point


def linear_plant(
    scenario: Scenario, *, sampled: bool = False, position: Any = None, load: Any = None, all_states: bool = False
) -> ct.StateSpace:
    """The plant of a scenario, linearised at an equilibrium.

    Args:
        scenario: a .yaml file or an earlier run.nc, the same as a mapping, or built.
        sampled: False for continuous time; True for the sampling time, exact for an input that is held.
        position: reference at which the loop rests, m and rad; None for that of `undertow analyze`.
        load: constant acceleration of the outputs, m/s^2 and rad/s^2; None for zero, or for the mean one of
            `undertow analyze` where there is no position either.
        all_states: whether the states are those of `plant`, one by one.

    Raises:
        BadInput: the scenario cannot be used, or its loop has no equilibrium there.
    """
    built = _without_ledger(built_of(scenario), all_states)
    return _plant(built, _equilibrium(built, position, load), sampled, all_states)


def linear_controller(
    scenario: Scenario, *, position: Any = None, load: Any = None, all_states: bool = False
) -> ct.StateSpace:
    """The controller of a scenario at its sampling time, linearised at an equilibrium; for arguments see above.

    Raises:
        BadInput: as of `linear_plant`, or the loop is continuous.
    """
    built = _without_ledger(sampled_of(scenario, "controller"), all_states)
    return _controller(built, _equilibrium(built, position, load), all_states)


def linear_closed_loop(
    scenario: Scenario, *, position: Any = None, load: Any = None, all_states: bool = False
) -> ct.StateSpace:
    """The closed loop of a scenario at its sampling time, linearised at an equilibrium; for arguments see above.

    Raises:
        BadInput: as of `linear_controller`.
    """
    built = _without_ledger(sampled_of(scenario, "closed loop"), all_states)
    point = _equilibrium(built, position, load)
    signals = signals_of(built.closed_loop.plant)
    plant = _plant(built, point, True, all_states)
    law = _controller(built, point, all_states)
    # The inputs of the law are the measurement y, the reference r and the applied input u. Inside the limits u is the
    # command, which does not depend on u itself: u = D_y C_plant x + C_law z + D_r r, with the states x and z.
    ends = np.cumsum([len(signals.measured), len(signals.desired)])
    b_y, b_r, b_u = np.split(law.B, ends, axis=1)
    d_y, d_r, _ = np.split(law.D, ends, axis=1)
    u_of_states = np.hstack([d_y @ plant.C, law.C])
    y_of_states = np.hstack([plant.C, np.zeros((len(plant.C), law.nstates))])
    without_u = np.block([[plant.A, np.zeros((plant.nstates, law.nstates))], [b_y @ plant.C, law.A]])
    a = without_u + np.vstack([plant.B, b_u]) @ u_of_states
    b = np.vstack([plant.B @ d_r, b_r + b_u @ d_r])
    c = np.vstack([y_of_states, u_of_states])
    d = np.vstack([np.zeros((len(y_of_states), len(signals.desired))), d_r])
    outputs = signals.measured | signals.command
    states = plant.state_labels + law.state_labels
    system = ct.ss(a, b, c, d, built.scenario.loop.dt)
    return _named(system, "closed_loop", signals.desired | outputs, list(signals.desired), list(outputs), states)


def _without_ledger(built: Built, all_states: bool) -> Built:
    """The scenario with a plant that keeps no account of its energy, unless all states are asked for."""
    plant = built.closed_loop.plant
    if all_states or not isinstance(plant, HybridVehicle) or not plant.power.ledger:
        return built
    power = plant.power
    with computing(built):
        plain = HybridVehicle(plant.vehicle, plant.thruster, power.battery, power.esc, False, plant.inflow_loss)
    return built._replace(closed_loop=dataclasses.replace(built.closed_loop, plant=plain))


def _equilibrium(built: Built, position: Any, load: Any) -> Equilibrium:
    loop = built.closed_loop
    dt = built.scenario.loop.dt
    axes = len(loop.plant.outputs)
    for name, value in (("position", position), ("load", load)):
        if value is not None and np.shape(value) != (axes,):
            raise BadInput(
                name, f"have {axes} entries ({', '.join(loop.plant.outputs)})", f"of shape {np.shape(value)}"
            )
    with computing(built):
        if position is None:
            if load is not None:
                raise BadInput("position", "be given with a load")
            point = operating_point(built).mean
        else:
            point = equilibrium(loop, dt, position, np.zeros(axes) if load is None else load)
    if not point.found:
        raise BadInput(
            "load", "leave the loop an equilibrium", f"one in which a state changes by {point.moving:.2g} per s"
        )
    return point


def _plant(built: Built, point: Equilibrium, sampled: bool, all_states: bool) -> ct.StateSpace:
    loop = point.parts.loop
    signals = signals_of(built.closed_loop.plant)
    plant = loop.plant
    zero = jnp.zeros(())

    def derivative(state: Any, u: Any) -> Any:
        unloaded = plant.no_load()
        pushed = unloaded._replace(acceleration=unloaded.acceleration + jnp.asarray(point.at["load"]))
        return vector_of(plant.dynamics(zero, point.parts.plant_state(state), u, pushed))

    def measurement(state: Any) -> Any:
        return vector_of_measurement(plant.output(zero, point.parts.plant_state(state)))

    with computing(built):
        state, u = jnp.asarray(point.at["plant"]), jnp.asarray(point.at["u"])
        a, b = map(np.asarray, jax.jit(jax.jacfwd(derivative, argnums=(0, 1)))(state, u))
        c = np.asarray(jax.jit(jax.jacfwd(measurement))(state))
        names = state_names(point.parts.plant_state(state), "plant")
        matrices = StateSpaceMatrices(a, b, c, names)
        matrices = matrices if all_states else seen(with_angles(matrices, np.asarray(state)))
    system = ct.ss(matrices.a, matrices.b, matrices.c, np.zeros((len(c), b.shape[1])))
    if sampled:
        system = ct.sample_system(system, built.scenario.loop.dt, "zoh")
    return _named(
        system,
        "plant",
        signals.applied | signals.measured,
        list(signals.applied),
        list(signals.measured),
        matrices.names,
    )


def _controller(built: Built, point: Equilibrium, all_states: bool) -> ct.StateSpace:
    loop = point.parts.loop
    signals = signals_of(built.closed_loop.plant)
    law = loop.controller
    dt = jnp.asarray(built.scenario.loop.dt)
    sizes = np.cumsum([len(signals.measured), len(signals.desired)])

    def update_and_command(state: Any, inputs_of_law: Any) -> Any:
        measured, desired, applied = jnp.split(inputs_of_law, sizes)
        z = point.parts.law_state(state)
        y = measurement_of(loop, measured)
        r = target_of(desired)
        return vector_of(law.advance(z, y, r, applied, dt)), law.command(z, y, r)[0]

    with computing(built):
        x = point.parts.plant_state(jnp.asarray(point.at["plant"]))
        state = jnp.asarray(point.at["law"])
        y = loop.plant.output(jnp.zeros(()), x)
        inputs_of_law = jnp.concatenate([vector_of_measurement(y), *point.parts.target, jnp.asarray(point.at["u"])])
        (a, b), (c, d) = jax.tree.map(
            np.asarray, jax.jit(jax.jacfwd(update_and_command, argnums=(0, 1)))(state, inputs_of_law)
        )
        names = state_names(point.parts.law_state(state), "law")
    matrices = StateSpaceMatrices(a, b, c, names)
    matrices = matrices if all_states else seen(matrices)
    inputs = signals.measured | signals.desired | signals.applied
    system = ct.ss(matrices.a, matrices.b, matrices.c, d, built.scenario.loop.dt)
    return _named(system, "controller", inputs | signals.command, list(inputs), list(signals.command), matrices.names)


def _named(
    system: Any, name: str, units: dict[str, str], inputs: list[str], outputs: list[str], states: list[str]
) -> ct.StateSpace:
    named: Any = ct.ss(system, inputs=inputs, outputs=outputs, states=states, name=name)
    named.units = units
    return named
