"""The functions of a controller that is stepped: its first step, the following ones, its output, the reference."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.autopilot.measured_motion import Format, Motion
from undertow.autopilot.output import Output
from undertow.core.contracts import AbstractController, Target
from undertow.loop.closed_loop import ClosedLoop
from undertow.loop.controller_step import Answer, Memory, first_step, next_step


class Given(NamedTuple):
    """What a step is given: the measured motion, what the actuators report (None or a tree), and the target."""

    motion: Motion
    actuator: Any
    target: Target


class Functions:
    """Functions of parts and arrays that JAX can trace, and examples of their arguments in the present precision.

    Args:
        loop: with the controller.
        form: of measured motions; for a plant that is no vehicle it does not matter.
        output: conversion of the command.

    Attributes:
        form: None for a plant that is no vehicle.
        given, applied, time: examples.
    """

    def __init__(self, loop: ClosedLoop, form: Format, output: Output):
        self.controller, self.output, self.reference = loop.controller, output, loop.reference
        truth = loop.plant.output(jnp.zeros(()), loop.plant.initial_state())
        self.form = None if truth.body is None else form
        kind = jax.dtypes.canonicalize_dtype(float)
        number = lambda shape: np.zeros(shape, dtype=kind)
        zero: Any = number(len(loop.plant.outputs))
        motion = Motion(zero, number(0), zero)
        if self.form is not None:
            upright = np.eye(4, dtype=kind)[0] if form.attitude == "quaternion" else number(3)
            motion = Motion(number(3), upright, number(6))
        actuator = jax.tree.map(lambda leaf: np.asarray(leaf, dtype=kind), truth.actuator)
        self.given = Given(motion, actuator, Target(zero, zero, zero))
        self.applied, self.time = number(loop.plant.inputs()), number(())

    def first(self, law: AbstractController, given: Given) -> tuple[Memory, Answer]:
        """The step with which control begins."""
        return first_step(law, self._measured(law, given), given.target)

    def following(self, law: AbstractController, memory: Memory, given: Given, applied: Any, dt: Any):
        """A step `dt` (s) after the last one."""
        return next_step(law, memory, self._measured(law, given), given.target, applied, dt)

    def _measured(self, law: AbstractController, given: Given):
        return given.motion.measurement(law.model.coordinates, self.form, given.actuator)
