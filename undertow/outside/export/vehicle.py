"""The plant of a scenario - a vehicle with its thrusters - under its disturbance as a system to export, and as C99."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import runtime
from undertow.core.arrays import in_present_precision
from undertow.core.batch_compiler import Unsupported
from undertow.core.contracts import AbstractDisturbance, AbstractPlant, Load
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import COMPACT_METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion, motion_in
from undertow.outside.export.c_program import CProgram, Exported, System, check_compiler, has_counterpart, made_from
from undertow.outside.export.controller import checked, described
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.scenario.build import Built
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.outcome import status_of
from undertow.simulation.loop.plant_step import PlantState, hold
from undertow.simulation.loop.simd_batch import realized_disturbance

_SPREAD = 2.0  # of the random commands of a test, V


class InitialOutputs(NamedTuple):
    """Outputs of the plant at the start, and their rates."""

    position: Any
    velocity: Any


class ExportedVehicleInput(NamedTuple):
    """Input of a step: start, command, force and moment from outside, and time at which the step begins."""

    initial: InitialOutputs
    command: Any
    external_wrench: Any
    t: Any


class ExportedVehicleOutput(NamedTuple):
    """Output of a step: true motion and report of the actuators at its end, input that was applied, status code.

    `signals` are those numbers that the plant declares, such as the voltage of a battery.
    """

    motion: MeasuredMotion
    actuator: Any
    applied: Any
    status: Any
    signals: dict[str, Any]


def export_vehicle(
    built: Built,
    name: str = "vehicle",
    *,
    precision: str | None = None,
    attitude: str = "euler",
    velocity: str = "body",
) -> Exported:
    """The plant of a scenario under its disturbance in C99.

    Args:
        built: the scenario; its seed realizes what is random of the disturbance.
        name: begins the names of files, types and functions; lower-case letters, digits and underscores.
        precision: float64 or float32; None for that of the scenario.
        attitude, velocity: formats of motions, as for `Autopilot`.

    Raises:
        BadInput: a format is unknown, or the plant or the disturbance needs something that has no counterpart in C99.
    """
    form = Format(attitude, velocity)
    checked_precision = checked(precision or built.scenario.precision, form)
    with runtime.on_processor(), runtime.in_precision(checked_precision):
        files = vehicle_program(built, name, form).files()
    return Exported(files | {"example.c": _EXAMPLE.replace("NAME", name)})


def vehicle_program(built: Built, name: str, form: Format) -> CProgram:
    """The C program of a plant under its disturbance, in the present precision.

    Raises:
        BadInput: the name is none for C, or the plant or the disturbance needs something that has no counterpart in C.
    """
    check_compiler()
    loop = in_present_precision(built.without_faults().closed_loop)
    if built.scenario.loop.method not in COMPACT_METHODS:
        must = f"be one of {', '.join(COMPACT_METHODS)} for a vehicle in C"
        raise BadInput("loop.method", must, built.scenario.loop.method)
    realization = None
    try:
        realization = jax.tree.map(jnp.asarray, realized_disturbance(loop, key_of_seed(built.scenario.seed)))
        return CProgram(_system(built, name, loop, form, realization))
    except Unsupported as error:
        where = "disturbance" if realization is None else _not_exported(loop, realization, built) or "plant"
        must = "be made of operations that the batch compiler has"
        raise BadInput(where, must, f"one that needs others: {error}") from None


def _system(built: Built, name: str, loop: ClosedLoop, form: Format, realization: Any) -> System:
    plant = loop.plant
    settings = built.scenario.loop
    truth = plant.output(jnp.zeros(()), plant.initial_state())
    zero, none = np.zeros(len(plant.outputs)), np.zeros(plant.inputs())
    initial = built.scenario.initial
    array_of = lambda values: zero if values is None else np.asarray(values)
    kind = jax.dtypes.canonicalize_dtype(float)
    example = ExportedVehicleInput(
        InitialOutputs(array_of(initial.position), array_of(initial.velocity)), none, zero, np.zeros(())
    )
    inputs = jax.tree.map(lambda leaf: np.asarray(leaf, dtype=kind), example)
    integrate = COMPACT_METHODS[settings.method]
    dt = jnp.asarray(settings.dt, dtype=float)

    def shown(t: Any, x: Any, applied: Any) -> ExportedVehicleOutput:
        truth, values = plant.output(t, x), plant.diagnostics(x, applied)
        numbers = {name: jnp.asarray(values[name], dtype=float) for name in numbers_of(plant)}
        return ExportedVehicleOutput(motion_in(form, truth), truth.actuator, applied, status_of(loop, x, ()), numbers)

    def start(inputs: ExportedVehicleInput):
        x = plant.initial_state(*inputs.initial)
        return x, shown(inputs.t, x, jnp.zeros_like(inputs.command))

    def step(x: Any, inputs: ExportedVehicleInput):
        disturbance = _WithOutsideWrench(loop.disturbance, inputs.external_wrench)
        part = Realization(dataclasses.replace(loop, disturbance=disturbance), realization, ())
        applied = plant.admissible(x, inputs.command)
        before = PlantState(x, (), ())
        after = hold(part, before, inputs.t, dt, applied, integrate, settings.substeps).plant
        return after, shown(inputs.t + dt, after, applied)

    def sample(chance: np.random.Generator, k: int) -> ExportedVehicleInput:
        random = lambda leaf: np.asarray(_SPREAD * chance.normal(size=leaf.shape), dtype=leaf.dtype)
        time = np.asarray(max(k - 1, 0) * settings.dt, dtype=kind)
        return inputs._replace(command=random(inputs.command), external_wrench=random(zero), t=time)

    meanings = {
        "state": "State of the vehicle; keep it between the steps.",
        "input": "Input of a step: position and velocity at the start, which the first step takes; "
        f"command, {plant.input_unit}; force and moment from outside, N and N m; time at the beginning of the step, s.",
        "output": f"Output of a step: true motion at its end, applied input, {plant.input_unit}, and status, 0 "
        f"while the motion is valid. {described(None if truth.body is None else form)}",
        "start": "The first output: sets the state.",
        "input.initial_position": "at the start, of all outputs",
        "input.initial_velocity": "at the start, rates of the outputs",
        "input.command": f"to be held during the step, in the order of the thrusters, {plant.input_unit}",
        "input.external_wrench": "force and moment from outside, body axes, N and N m",
        "input.t": "at the beginning of the step, s",
        "output.applied": f"the command within the limits, {plant.input_unit}",
        "output.status": "; ".join(f"{int(code)} {code.word}" for code in Status),
        "step": "A step of one sampling time from input->t on, with the command held.",
    }
    kind_of_plant = "Plant" if truth.body is None else "Underwater vehicle with its thrusters"
    about = made_from(f"{kind_of_plant}, under its disturbance", built.scenario.description)
    return System(name, about, meanings, start, step, inputs, sample, settings.dt)


def numbers_of(plant: AbstractPlant) -> dict[str, Signal]:
    """The signals of a plant that are numbers, by name."""
    return {name: signal for name, signal in plant.signals().items() if signal.dimensions == ()}


class _WithOutsideWrench(AbstractDisturbance):
    """A disturbance, and a force and moment from outside."""

    inner: AbstractDisturbance
    wrench: Float[Array, " k"]  # N and N m, body axes

    def realize(self, key):
        return self.inner.realize(key)

    def at(self, realization, t, pose, load: Load) -> Load:
        return self.inner.at(realization, t, pose, load._replace(wrench=load.wrench - self.wrench))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return self.inner.jumps(duration)


def _not_exported(loop: ClosedLoop, realization: Any, built: Built) -> str:
    """Key of the disturbance that has no counterpart in C; "" where all have one."""
    is_sum = isinstance(loop.disturbance, SumOfDisturbances)
    members = loop.disturbance.members if isinstance(loop.disturbance, SumOfDisturbances) else (loop.disturbance,)
    realized = realization if is_sum else (realization,)
    parts = built.scenario.disturbance if isinstance(built.scenario.disturbance, list) else [built.scenario.disturbance]
    x = loop.plant.initial_state()
    for i, (member, random_part) in enumerate(zip(members, realized, strict=True)):
        load = lambda t, member=member, random_part=random_part: member.at(
            random_part, t, loop.plant.pose(x), loop.plant.no_load()
        )
        if not has_counterpart(load, jnp.zeros(())):
            return f"disturbance{f'[{i}]' if is_sum else ''} ({parts[i].kind})"
    return ""


_EXAMPLE = """\
/* The vehicle with a constant command, for ten seconds. */
#include <stdio.h>

#include "NAME.h"

int main(void) {
    static NAME_state state;
    NAME_input input = NAME_DEFAULTS;
    NAME_output output;
    NAME_start(&state, &input, &output);
    for (int k = 0; (k * NAME_PERIOD < 10) && (output.status == 0); ++k) {
        for (unsigned i = 0; i < sizeof input.command / sizeof input.command[0]; ++i) {
            input.command[i] = 1;
        }
        input.t = k * NAME_PERIOD;
        NAME_step(&state, &input, &output);
    }
    for (unsigned i = 0; i < sizeof output.motion_position / sizeof output.motion_position[0]; ++i) {
        printf("%g ", (double)output.motion_position[i]);
    }
    printf("\\n");
    return 0;
}
"""
