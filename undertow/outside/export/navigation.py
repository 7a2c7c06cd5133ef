"""The navigation filter of a scenario as a system to export, and as C99 with an example."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.navigation.from_sensors import SensorNavigation
from undertow.core import checks, runtime
from undertow.core.batch_compiler import Unsupported
from undertow.core.errors import BadInput
from undertow.outside.autopilot.filter_functions import EstimatedMotion, FilterFunctions
from undertow.outside.export.c_program import CProgram, Exported, System, check_compiler, made_from
from undertow.physics.sensors.received import Received
from undertow.scenario.build import Built

_SPREAD = 0.01  # of the random readings of a test, in their units


class NavigationInput(NamedTuple):
    """Input of a step: motion at the start, which only the first step takes, what arrived, and time since the last."""

    motion: Any
    sensor: Any  # name -> Received
    dt: Any


def export_navigation(built: Built, name: str = "navigation", *, precision: str | None = None) -> Exported:
    """The navigation filter of a scenario in C99.

    Args:
        built: the scenario.
        name: begins the names of files, types and functions; lower-case letters, digits and underscores.
        precision: float64 or float32; None for that of the scenario.

    Raises:
        BadInput: the scenario's navigation is not a filter of readings, or needs something without counterpart in C99.
    """
    chosen_precision = precision or built.scenario.precision
    checks.choice("precision", chosen_precision, ("float64", "float32"))
    with runtime.on_processor(), runtime.in_precision(chosen_precision):
        files = navigation_program(built, name).files()
    return Exported(files | {"example.c": _EXAMPLE.replace("NAME", name)})


def navigation_program(built: Built, name: str) -> CProgram:
    """The C program of a navigation filter, in the present precision.

    Raises:
        BadInput: as of `export_navigation`, or the name is none for C.
    """
    check_compiler()
    navigation = built.closed_loop.navigation
    if not isinstance(navigation, SensorNavigation):
        raise BadInput("navigation", "be one of sensors: `kalman` or `observer`", built.scenario.navigation.kind)
    try:
        return CProgram(_system(built, name, FilterFunctions(navigation.filter, built.closed_loop.plant)))
    except Unsupported as error:
        must = "be made of operations that the batch compiler has"
        raise BadInput("navigation", must, f"one that needs others: {error}") from None


def _system(built: Built, name: str, functions: FilterFunctions) -> System:
    period = built.scenario.loop.dt
    nothing_received = dict(zip(functions.sensors, functions.nothing, strict=True))
    delays = dict(zip(functions.sensors, functions.delays, strict=True))
    readings_with_delays = {
        sensor: received._replace(age=jnp.asarray(delays[sensor], dtype=float))
        for sensor, received in nothing_received.items()
    }
    inputs = jax.tree.map(
        np.asarray, NavigationInput(functions.pose, readings_with_delays, jnp.asarray(period, dtype=float))
    )

    def advanced(state: Any, inputs: NavigationInput, elapsed: Any):
        return functions.following(
            functions.filter, state, elapsed, tuple(inputs.sensor[sensor] for sensor in functions.sensors)
        )

    def start(inputs: NavigationInput):
        return advanced(
            functions.first(functions.filter, EstimatedMotion(*inputs.motion)), inputs, jnp.zeros_like(inputs.dt)
        )

    def step(state: Any, inputs: NavigationInput):
        return advanced(state, inputs, inputs.dt)

    def sample(chance: np.random.Generator, k: int) -> NavigationInput:
        def delivered(i: int, at_rest: Any, received: Received) -> Received:
            reading = at_rest + _SPREAD * chance.normal(size=received.reading.shape)
            return received._replace(
                reading=reading.astype(received.reading.dtype), fresh=np.asarray(k % (3 * i + 1) == 0)
            )

        sensors_at_rest = zip(functions.sensors, map(np.asarray, functions.at_rest), strict=True)
        readings = {
            sensor: delivered(i, reading_at_rest, inputs.sensor[sensor])
            for i, (sensor, reading_at_rest) in enumerate(sensors_at_rest)
        }
        return inputs._replace(sensor=readings)

    meanings = {
        "state": "State of the filter; keep it between the steps.",
        "input": "Input of a step: motion, which the first step takes (position north, east, down, m; velocity u, v, "
        "w, p, q, r, m/s and rad/s; attitude w, x, y, z, body to world); of each sensor its reading, whether it is "
        "new, and its age, s; time since the last step, s.",
        "output": "Output of a step: estimated motion, what propellers report, signals of the filter.",
        "start": "The first step: sets the state from input->motion.",
        "input.motion_position": "at the start: north, east, down, m",
        "input.motion_velocity": "at the start: u, v, w, m/s, p, q, r, rad/s, body axes",
        "input.motion_attitude": "at the start: w, x, y, z, body to world",
        "input.dt": "time since the last step, s",
        "output.motion_position": "north, east, down, m",
        "output.motion_velocity": "u, v, w, m/s, p, q, r, rad/s, body axes",
        "output.motion_attitude": "w, x, y, z, body to world",
        "step": "A step input->dt after the last one. Entries of readings that were not measured are NAN.",
    }
    for sensor, part in zip(functions.sensors, functions.filter.sensors, strict=True):
        meanings[f"input.sensor_{sensor}_reading"] = " ".join(str(type(part).__doc__).split("\n\n")[0].split())
        meanings[f"input.sensor_{sensor}_fresh"] = "whether the reading is new"
        meanings[f"input.sensor_{sensor}_age"] = "s since it was taken"
    for signal, declared in functions.filter.signals().items():
        meanings[f"output.signals_{signal}"] = declared.meaning
    about = made_from("Navigation filter of an underwater vehicle", built.scenario.description)
    return System(name, about, meanings, start, step, inputs, sample, period)


_EXAMPLE = """\
/* The filter in a loop: fill in what the comments say. */
#include "NAME.h"

int main(void) {
    static NAME_state state;
    NAME_input input = NAME_DEFAULTS;
    NAME_output output;
    for (int k = 0; k < 100; ++k) {
        /* Measure: write input.sensor_imu_reading, and set input.sensor_imu_fresh where it is new. */
        input.sensor_imu_fresh = true;
        input.sensor_imu_reading[7] = -9.81; /* a level vehicle at rest */
        (k == 0) ? NAME_start(&state, &input, &output) : NAME_step(&state, &input, &output);
        /* Give output.motion_position, .motion_velocity and .motion_attitude to the controller. */
    }
    return 0;
}
"""
