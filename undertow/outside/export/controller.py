"""The controller of a scenario as a system to export, and as C99 with an example."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import checks, runtime
from undertow.core.arrays import in_present_precision
from undertow.core.batch_compiler import Unsupported
from undertow.core.contracts import starting_at
from undertow.core.errors import BadInput
from undertow.outside.autopilot.clock import MISSED
from undertow.outside.autopilot.functions import Functions, StepInputs
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.autopilot.output import output_of
from undertow.outside.export.c_program import CFunction, CProgram, Exported, System, made_from
from undertow.physics.power.esc import ESC
from undertow.scenario.build import Built

_ATTITUDES = {"euler": "roll, pitch, yaw, rad", "quaternion": "w, x, y, z, body to world"}
_SPREAD = 0.2  # of the random numbers of a test, m, rad, V


class ControllerInput(NamedTuple):
    """Input of a step: measured motion, what the actuators report, target, input applied, time since the last step."""

    motion: Any
    actuator: Any
    target: Any
    health: Any  # None where the controller does not ask for it
    applied: Any
    dt: Any


class ControllerOutput(NamedTuple):
    """Output of a step: command of the law, and what the vehicle takes."""

    command: Any
    output: Any


def export_controller(
    built: Built,
    name: str = "controller",
    *,
    precision: str | None = None,
    attitude: str = "euler",
    velocity: str = "body",
    output: str = "input",
    esc: ESC | None = None,
) -> Exported:
    """The controller of a scenario in C99.

    Args:
        built: the scenario.
        name: begins the names of files, types and functions; lower-case letters, digits and underscores.
        precision: float64 or float32; None for that of the scenario.
        attitude, velocity: formats of measured motions, as for `Autopilot`.
        output: what the vehicle takes, as for `Autopilot`.
        esc: speed controllers for `pulses`; None for usual ones.

    Raises:
        BadInput: a format is unknown, or the controller needs something that has no counterpart in C99.
    """
    form = Format(attitude, velocity)
    checked_precision = checked(precision or built.scenario.precision, form)
    with runtime.on_processor(), runtime.in_precision(checked_precision):
        files = controller_program(built, name, functions_of(built, form, output, esc)).files()
    return Exported(files | {"example.c": _EXAMPLE.replace("NAME", name)})


def checked(precision: str, form: Format) -> str:
    """The precision, if it and the formats are known.

    Raises:
        BadInput: there is no such precision or format.
    """
    checks.choice("precision", precision, ("float64", "float32"))
    checks.choice("attitude", form.attitude, tuple(_ATTITUDES))
    form.check()
    return precision


def functions_of(built: Built, form: Format, output: str = "input", esc: ESC | None = None) -> Functions:
    """The functions of the controller in the present precision."""
    loop = in_present_precision(built.without_faults().closed_loop)
    return Functions(loop, form, output_of(output, loop.plant, loop.controller, esc))


def controller_program(built: Built, name: str, functions: Functions) -> CProgram:
    """The C program of a controller, in the present precision.

    Raises:
        BadInput: the name is none for C, or the controller needs something that has no counterpart in C99.
    """
    reference = starting_at(functions.reference, functions.given.target.position)
    target = "Target of the scenario's reference at a time."
    further = CFunction("reference", "target", target, reference.at, "Target of the scenario's reference at t, s.")
    try:
        return CProgram(_system(built, name, functions), [further])
    except Unsupported as error:
        must = "be made of operations that the batch compiler has"
        raise BadInput("controller", must, f"one that needs others: {error}") from None


def _system(built: Built, name: str, functions: Functions) -> System:
    period, unit = built.scenario.loop.dt, built.closed_loop.plant.input_unit
    steps = functions.steps
    inputs = ControllerInput(*functions.given, functions.applied, np.asarray(period, dtype=functions.time.dtype))

    def answered(memory, answer):
        return memory, ControllerOutput(answer.command, functions.output.of(answer.command))

    def start(inputs: ControllerInput):
        return answered(*steps.first(functions.controller, StepInputs(*inputs[:4])))

    def step(memory, inputs: ControllerInput):
        """As `Autopilot` does: no further than a missed step; a time that is none leaves the state as it was.

        A supervisor gets the time as it is.
        """
        if functions.controller.takes_raw_readings:
            return answered(
                *steps.following(functions.controller, memory, StepInputs(*inputs[:4]), inputs.applied, inputs.dt)
            )
        usual = jnp.asarray(period, dtype=inputs.dt.dtype)
        is_valid = (inputs.dt > 0) & (inputs.dt < jnp.inf)
        elapsed = jnp.where(is_valid, jnp.minimum(inputs.dt, MISSED * usual), usual)
        after, answer = answered(
            *steps.following(functions.controller, memory, StepInputs(*inputs[:4]), inputs.applied, elapsed)
        )
        return jax.tree.map(lambda new, old: jnp.where(is_valid, new, old), after, memory), answer

    def sample(chance: np.random.Generator, _: int) -> ControllerInput:
        random = lambda leaf: np.asarray(leaf + _SPREAD * chance.normal(size=leaf.shape), dtype=leaf.dtype)
        return jax.tree.map(random, inputs)._replace(dt=inputs.dt)

    about = made_from("Controller of an underwater vehicle", built.scenario.description)
    return System(name, about, _meanings(functions, unit), start, step, inputs, sample, period)


def _meanings(functions: Functions, unit: str) -> dict[str, str]:
    """What structs, members and functions mean; `unit` is that of the plant's input."""
    outputs = "north, east, down, m, roll, pitch, yaw, rad" if functions.form else "outputs of the plant"
    return {
        "state": "State of the controller; keep it between the steps.",
        "input": f"Input of a step. {described(functions.form)}",
        "output": f"Output of a step: the law's command and the output, {functions.output.unit}.",
        "start": "The first step: sets the state; all of its input has to be finite.",
        "step": "A step input->dt after the last one, with input->applied applied since then. What was not measured is "
        f"NAN. After more than {MISSED:g} sampling times the law advances by {MISSED:g} of them; a dt that is zero, "
        "negative or not finite leaves the state as it was. A supervisor gets the time as it is.",
        "input.motion_position": "north, east, down, m" if functions.form else outputs,
        "input.motion_attitude": "" if functions.form is None else _ATTITUDES[functions.form.attitude],
        "input.motion_velocity": f"`{functions.form.velocity}`, m/s and rad/s"
        if functions.form
        else "rates of the outputs",
        "input.actuator_speed": "of each propeller, rad/s; NAN where it is not measured",
        "input.actuator_acceleration": "of each propeller, rad/s^2; NAN where it is not measured",
        "input.target_position": f"to reach: {outputs}",
        "input.target_velocity": "rates of the target",
        "input.target_acceleration": "second derivatives of the target",
        "input.health": "of each thruster: 1, or 0 where it announced that it has failed",
        "input.applied": f"to be set at each step: what was applied since the last, {unit}; output->command, or less",
        "input.dt": "time since the last step, s",
        "output.command": f"of the law, in the order of the thrusters, {unit}; see that it is finite",
        "output.output": f"for the vehicle, {functions.output.unit}",
    }


def described(form: Format | None) -> str:
    """The format of a motion, in words; None for a plant that is no vehicle."""
    if form is None:
        return "Position and velocity are the outputs of the plant and their rates."
    attitude_format = _ATTITUDES[form.attitude]
    return f"Position north, east, down, m; attitude {attitude_format}; velocity `{form.velocity}`, m/s and rad/s."


_EXAMPLE = """\
/* The controller in a loop: fill in what the comments say. */
#include "NAME.h"

int main(void) {
    static NAME_state state;
    NAME_input input = NAME_DEFAULTS;
    NAME_output output;
    NAME_target target;
    for (int k = 0; k < 100; ++k) {
        /* Measure: input.motion_position, input.motion_velocity and, of a vehicle, input.motion_attitude. */
        NAME_reference(k * NAME_PERIOD, &target);
        for (unsigned i = 0; i < sizeof target.position / sizeof target.position[0]; ++i) {
            input.target_position[i] = target.position[i];
            input.target_velocity[i] = target.velocity[i];
            input.target_acceleration[i] = target.acceleration[i];
        }
        (k == 0) ? NAME_start(&state, &input, &output) : NAME_step(&state, &input, &output);
        for (unsigned i = 0; i < sizeof output.command / sizeof output.command[0]; ++i) {
            input.applied[i] = output.command[i]; /* Or what was applied: less, where the supply sagged. */
        }
        /* Write output.output to the thrusters, and wait for the next period. */
    }
    return 0;
}
"""
