"""The plant of a scenario with its disturbances and navigation, stepped from outside with the input to hold."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from undertow.autopilot.numbers import numbers, step_of
from undertow.core import checks, runtime
from undertow.core.contracts import Inputs, Outputs, Time
from undertow.core.errors import BadInput, within
from undertow.core.measurement import body_of
from undertow.loop.closed_loop import ClosedLoop, MeasurementState, Realization
from undertow.loop.outcome import status_of
from undertow.loop.recording import instant
from undertow.loop.sampled import moved
from undertow.loop.stepped import put, realized
from undertow.numerics.integrators import METHODS
from undertow.numerics.random_keys import key_of_seed
from undertow.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.sensors.motion import motion_of


class Observed(NamedTuple):
    """What is observed of the vehicle at a control step.

    Attributes:
        position: measured: north, east, down, m.
        quaternion: measured: w, x, y, z, body -> world.
        velocity: measured: u, v, w, p, q, r, body axes, m/s and rad/s.
        specific_force: true, the mean since the last step, body axes, m/s^2.
        applied: input that was applied since the last step, in the unit of the plant's input.
        status: `Status` of the true state.
    """

    position: Any
    quaternion: Any
    velocity: Any
    specific_force: Any
    applied: Any
    status: Any


class _State(NamedTuple):
    """What changes from step to step."""

    plant: Any
    navigation: Any
    steps: Int[Array, ""]


class SimulatedVehicle:
    """The vehicle of a scenario without its controller: `step` holds an input for one sampling time.

    Given the inputs of a simulation it has the motion of that simulation, bit for bit where the batch compiler knows
    all of its parts (`backend`).

    Args:
        built: a scenario with a vehicle and a sampled loop.
        sampling_time: s; None for that of the scenario.

    Attributes:
        sampling_time: s.
        duration: of the scenario, s.
        thrusters: how many.
        input_unit: of their inputs.
        backend: `simd` or `xla`.

    Raises:
        BadInput: the plant is no vehicle with thrusters, or the loop is continuous.
    """

    def __init__(self, built: Built, sampling_time: float | None = None):
        loop, settings = built.closed_loop, built.scenario.loop
        check_vehicle(built)
        period = settings.dt if sampling_time is None else sampling_time
        checks.positive("sampling_time", period, "s")
        self.sampling_time, self.duration = float(period), settings.duration
        self.thrusters, self.input_unit = loop.plant.inputs(), loop.plant.input_unit
        self._method, self._substeps = METHODS[settings.method], settings.substeps
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            self._compile(loop, built)

    def _compile(self, loop: ClosedLoop, built: Built) -> None:
        initial = built.scenario.initial
        start = loop.outputs_at_start(initial.position, initial.velocity)
        part = realized(loop, key_of_seed(built.scenario.seed))
        begin = step_of(lambda part, _, start: ((), _first(part, start)), part, (), start)
        begin()
        self._first_state, self._first = begin.outputs
        held = np.zeros(self.thrusters, dtype=jax.dtypes.canonicalize_dtype(float))
        self._go_on = step_of(self._next, part, jax.tree.map(jnp.asarray, self._first_state), held)
        self.backend = self._go_on.backend

    def start(self) -> Observed:
        """Begin at time zero, at the start that the scenario states."""
        put(self._go_on.state, self._first_state)
        return jax.tree.map(np.copy, self._first)

    def step(self, command: Any) -> Observed:
        """Hold an input for one sampling time; limited as the thrusters limit it.

        Raises:
            BadInput: another shape, or a number that is not finite.
        """
        given = numbers("command", command, (self.thrusters,))
        checks.finite("command", given)
        put(self._go_on.inputs, given)
        self._go_on()
        return jax.tree.map(np.copy, self._go_on.outputs)

    def _next(self, part: Realization, state: _State, command: Float[Array, " m"]):
        dt, loop, before = jnp.asarray(self.sampling_time), part.loop, state.plant
        t, applied = instant(state.steps, dt), loop.plant.admissible(before, command)
        x = moved(lambda t, x: part.motion(t, x, applied), t, before, dt, self._method, self._substeps)
        return _observed(part, _State(x, state.navigation, state.steps + 1), before, applied, dt)


def _first(part: Realization, start: tuple[Outputs, Outputs]) -> tuple[_State, Observed]:
    """State and observation at time zero, with no input."""
    x = part.loop.plant.initial_state(*start)
    navigation = part.initial_measuring(x).navigation
    still, zero = jnp.zeros(part.loop.plant.inputs()), jnp.zeros(())
    return _observed(part, _State(x, navigation, jnp.zeros((), dtype=int)), x, still, zero)


def _observed(part: Realization, state: _State, before: Any, applied: Inputs, dt: Time) -> tuple[_State, Observed]:
    """State after the reading of this control step, and what is observed."""
    loop = part.loop
    t = instant(state.steps, dt)
    truth = loop.plant.output(t, state.plant)
    # Without expected values in place of readings that are not finite: the controller has them.
    y, measuring = part.read(t, truth, MeasurementState(state.navigation, None))
    body = body_of(y)
    force = motion_of(truth, loop.plant.output(t, before).velocity[:3], dt).specific_force
    observed = Observed(y.position[:3], body.attitude, body.nu, force, applied, status_of(loop, state.plant, ()))
    return state._replace(navigation=measuring.navigation), observed


def check_vehicle(built: Built) -> None:
    """Check that a scenario has a vehicle with thrusters in a sampled loop, whose law needs no propeller speeds.

    Raises:
        BadInput: it has not.
    """
    with within(location=built.text.location):
        if not isinstance(built.closed_loop.plant, HybridVehicle):
            raise BadInput("plant", "be a vehicle with thrusters", built.scenario.plant.kind)
        if built.scenario.loop.kind != "sampled":
            raise BadInput("loop.kind", "be sampled", built.scenario.loop.kind)
        if built.scenario.model.options.get("speed_sensor"):
            raise BadInput("model.speed_sensor", "be false: there is no message for the speeds of propellers", "true")
