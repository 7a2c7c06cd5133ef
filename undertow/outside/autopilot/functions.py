"""The functions of a controller that is stepped: its first step, the following ones, its output, the reference."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import AbstractController, Measurement, Target
from undertow.core.numerics.random_keys import key_of_seed
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion
from undertow.outside.autopilot.output import Output
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.controller_step import Answer, ControllerMemory, first_step, next_step


class StepInputs(NamedTuple):
    """What a step is given.

    Attributes:
        motion: as measured.
        actuator: what the actuators report; None or a tree.
        target: to follow.
        health: of the actuators, see `Measurement`; None for a loop in which none announces anything.
    """

    motion: MeasuredMotion
    actuator: Any
    target: Target
    health: Any = None


@dataclasses.dataclass(frozen=True)
class ControllerSteps:
    """Steps of a controller that gets measured motions in a format; None for a plant that is no vehicle."""

    form: Format | None

    def first(self, law: AbstractController, inputs: StepInputs) -> tuple[ControllerMemory, Answer]:
        """The step with which control begins."""
        return first_step(law, self._measured(law, inputs), inputs.target)

    def following(self, law: AbstractController, memory: ControllerMemory, inputs: StepInputs, applied: Any, dt: Any):
        """A step `dt` (s) after the last one."""
        return next_step(law, memory, self._measured(law, inputs), inputs.target, applied, dt)

    def _measured(self, law: AbstractController, inputs: StepInputs):
        measured = inputs.motion.measurement(law.model.coordinates, self.form, inputs.actuator)
        return measured._replace(health=inputs.health)


class Functions:
    """Functions of parts and arrays that JAX can trace, and examples of their arguments in the present precision.

    Args:
        loop: with the controller.
        form: of measured motions; for a plant that is no vehicle it does not matter.
        output: conversion of the command.

    Attributes:
        form: None for a plant that is no vehicle.
        steps: of the controller.
        given, applied, time: examples.
    """

    def __init__(self, loop: ClosedLoop, form: Format, output: Output):
        self.controller = loop.controller
        self.output = output
        self.reference = loop.reference
        truth = loop.plant.output(jnp.zeros(()), loop.plant.initial_state())
        self.form = None if truth.body is None else form
        self.steps = ControllerSteps(self.form)
        kind = jax.dtypes.canonicalize_dtype(float)
        number = lambda shape: np.zeros(shape, dtype=kind)
        zero: Any = number(len(loop.plant.outputs))
        motion = MeasuredMotion(zero, number(0), zero)
        if self.form is not None:
            names = form.columns()
            upright = np.array([float(name == "w") for name in names.attitude], dtype=kind)
            motion = MeasuredMotion(number(3), upright, number(len(names.velocity)))
        actuator = jax.tree.map(lambda leaf: np.asarray(leaf, dtype=kind), truth.actuator)
        self.given = StepInputs(motion, actuator, Target(zero, zero, zero), _healthy(loop, truth))
        self.applied, self.time = number(loop.plant.inputs()), number(())


def _healthy(loop: ClosedLoop, truth: Measurement) -> Any:
    """Health of actuators that all work; None where nobody announces anything, or would listen."""
    if loop.controller.takes_raw_readings:
        return np.ones(loop.plant.inputs(), dtype=jax.dtypes.canonicalize_dtype(float))
    if loop.faults is None:
        return None
    faults = loop.faults
    key = key_of_seed(0)

    def health(truth: Measurement):
        realization = faults.realize(key)
        state = faults.init(realization, truth, jnp.zeros(loop.plant.inputs()))
        return faults.measurement(realization, state, jnp.zeros(()), truth)[0].health

    return jax.tree.map(lambda leaf: np.ones(leaf.shape, leaf.dtype), jax.eval_shape(health, truth))
