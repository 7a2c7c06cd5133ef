"""One step of a plant with its disturbances, faults and navigation: a closed loop without its controller.

Whoever has a controller of his own steps this: `ut.Vehicle`, the links of `undertow run`, ROS 2, ArduPilot, Gymnasium.
With the inputs of a simulation it is that simulation.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Int

from undertow.core.contracts import Inputs, Measurement, Outputs, Time
from undertow.simulation.loop.closed_loop import MeasurementState, Realization
from undertow.simulation.loop.outcome import status_of
from undertow.simulation.loop.sampled import integrate_plant


class PlantState(NamedTuple):
    """What changes from step to step: states of plant, navigation and faults."""

    plant: Any
    navigation: Any
    faults: Any


class PlantObservation(NamedTuple):
    """What there is to observe after a step.

    Attributes:
        truth: outputs of the plant and their rates.
        measurement: as the navigation gives it, with the faults of sensors; not finite where there is none.
        applied: input since the last one, as far as a controller knows.
        status: a Status code of the true state.
    """

    truth: Measurement
    measurement: Measurement
    applied: Inputs
    status: Int[Array, ""]


def begin(realization: Realization, start: tuple[Outputs, Outputs]) -> tuple[PlantState, PlantObservation]:
    """State and observation at time zero, with no input."""
    x = realization.loop.plant.initial_state(*start)
    measuring = realization.initial_measuring(x)
    zero_input = jnp.zeros(realization.loop.plant.inputs())
    return observe(realization, PlantState(x, measuring.navigation, measuring.faults), jnp.zeros(()), zero_input)


def hold(
    realization: Realization, state: PlantState, t: Time, dt: Any, applied: Inputs, integrate: Callable, substeps: int
) -> PlantState:
    """State after an input was held for a time.

    Args:
        realization: the closed loop.
        state: at t.
        t: s.
        dt: how long, s.
        applied: input within the limits of the plant; faults may change what acts.
        integrate, substeps: integration, as of `sampled.integrate_plant`.
    """
    acting = applied
    if realization.loop.faults is not None:
        acting, faults = realization.failed(state.faults, t, state.plant, applied)
        state = state._replace(faults=faults)
    motion = lambda t, x: realization.motion(t, x, acting)
    return state._replace(plant=integrate_plant(motion, t, state.plant, dt, integrate, substeps))


def observe(
    realization: Realization, state: PlantState, t: Time, applied: Inputs
) -> tuple[PlantState, PlantObservation]:
    """State after the reading at a time, and what there is to observe."""
    truth = realization.loop.plant.output(t, state.plant)
    # Without expected values in place of readings that are not finite: the controller has them.
    measuring = MeasurementState(state.navigation, None, state.faults)
    measurement, measuring = realization.read(t, truth, measuring)
    state = PlantState(state.plant, measuring.navigation, measuring.faults)
    return state, PlantObservation(truth, measurement, applied, status_of(realization.loop, state.plant, ()))
