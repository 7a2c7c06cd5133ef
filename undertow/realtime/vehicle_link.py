"""The vehicle of a scenario in the same process, with its navigation, disturbances and faults, as a link."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from undertow.autopilot.measured_motion import Format
from undertow.autopilot.numbers import numbers, step_of
from undertow.core import runtime
from undertow.core.contracts import Inputs, Measurement, Outputs, Time
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop, MeasurementState, Realization
from undertow.loop.outcome import status_of
from undertow.loop.sampled import moved
from undertow.loop.stepped import put, realized
from undertow.numerics.integrators import METHODS
from undertow.numerics.random_keys import key_of_seed
from undertow.realtime.link import AbstractLink, LinkMeasurement
from undertow.scenario.build import Built

_WHOLE = 1e-9  # sampling times, within which a time is one


class _State(NamedTuple):
    """What changes from step to step."""

    plant: Any
    navigation: Any
    faults: Any


class _Given(NamedTuple):
    """Inputs of a step."""

    t: Any  # s, at which it begins
    then: Any  # s, at which it ends
    dt: Any  # s
    command: Any  # that is held


class _Observed(NamedTuple):
    """What is observed after a step."""

    y: Measurement  # as the navigation gives it, with the faults of sensors
    applied: Inputs  # since the last one, as far as the controller knows
    status: Int[Array, ""]


class VehicleLink(AbstractLink):
    """The vehicle, or another plant, of a scenario. It moves when a measurement is asked for, by the time since then.

    Steps of the length of the scenario's sampling time have the bits of `undertow simulate`, where the batch compiler
    knows all parts (`backend`). A longer time is divided into such steps and a rest, with the last command held.

    Args:
        built: a scenario with a sampled loop.

    Attributes:
        backend: `simd` or `xla`.

    Raises:
        BadInput: the loop is continuous.
    """

    def __init__(self, built: Built):
        loop, settings = built.closed_loop, built.scenario.loop
        if settings.kind != "sampled":
            raise BadInput("loop.kind", "be sampled", settings.kind)
        self._period, self._plant = float(settings.dt), loop.plant
        self._method, self._substeps = METHODS[settings.method], settings.substeps
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            self._compile(loop, built)
        self.form = None if self._first.y.body is None else Format("both", "both")
        self._seen, self._command = self._first, np.zeros(loop.plant.inputs())
        self._since, self._steps, self._began = 0.0, 0, False
        self._sent = 0

    def _compile(self, loop: ClosedLoop, built: Built) -> None:
        initial = built.scenario.initial
        start = loop.outputs_at_start(initial.position, initial.velocity)
        part = realized(loop, key_of_seed(built.scenario.seed))
        begin = step_of(lambda part, _, start: ((), _first(part, start)), part, (), start)
        begin()
        first, self._first = begin.outputs
        types = eqx.filter_eval_shape(lambda part, start: _first(part, start)[0], part, start)
        typed = lambda value, like: jnp.asarray(value, dtype=like.dtype)
        zero = np.zeros((), dtype=jax.dtypes.canonicalize_dtype(float))
        given = _Given(zero, zero, zero, np.zeros(loop.plant.inputs(), dtype=zero.dtype))
        self._go_on = step_of(self._next, part, jax.tree.map(typed, first, types), given)
        put(self._go_on.state, first)
        self.backend = self._go_on.backend

    def _next(self, part: Realization, state: _State, given: _Given):
        loop, before, (t, then, dt, command) = part.loop, state.plant, given
        applied = acting = loop.plant.admissible(before, command)
        if loop.faults is not None:
            acting, faults = part.failed(state.faults, t, before, applied)
            state = state._replace(faults=faults)
        x = moved(lambda t, x: part.motion(t, x, acting), t, before, dt, self._method, self._substeps)
        return _observed(part, state._replace(plant=x), then, applied)

    @property
    def time(self) -> float:
        """s since the start, as a simulation counts it."""
        return self._since + self._steps * self._period

    def receive(self, elapsed: float) -> LinkMeasurement:
        if self._began and elapsed > 0:
            self._move(elapsed)
        applied = self._seen.applied if self._began else None
        self._began = True
        return _measurement(self._seen, applied)

    def _move(self, elapsed: float) -> None:
        """Hold the command for a time, s; a failed vehicle stays where it is."""
        whole = int(elapsed / self._period * (1 + _WHOLE))
        rest = elapsed - whole * self._period
        for _ in range(whole):
            if self.ended:
                return
            self._step(self._period, (self._since, self._steps + 1))
        if rest > _WHOLE * self._period and not self.ended:
            self._step(rest, (self.time + rest, 0))

    def _step(self, dt: float, after: tuple[float, int]) -> None:
        """A step of the integrator; `after` is the time after it: seconds, and whole sampling times since then."""
        t = self.time
        self._since, self._steps = after
        put(self._go_on.inputs, _Given(np.asarray(t), np.asarray(self.time), np.asarray(dt), self._command))
        self._go_on()
        self._seen = self._go_on.outputs
        status = Status(int(self._seen.status))
        if status is not Status.OK:
            self.ended, self.failed = f"the vehicle failed at {self.time:.4g} s: {status.sentence}", True

    def send(self, command: np.ndarray) -> None:
        self._command, self._sent = numbers("command", command, self._command.shape).copy(), self._sent + 1

    def finish(self, safe: np.ndarray) -> None:
        self.send(safe)

    @property
    def last_command(self) -> np.ndarray:
        """The command that was sent last."""
        return self._command.copy()

    def counts(self) -> dict[str, int]:
        return {"commands": self._sent}


def _measurement(seen: _Observed, applied: Any) -> LinkMeasurement:
    y = seen.y
    reports = tuple(leaf.copy() for leaf in jax.tree.leaves(y.actuator))
    health = None if y.health is None else y.health.copy()
    given = None if applied is None else applied.copy()
    more = {"propellers": reports or None, "health": health, "applied": given}
    if y.body is None:
        return LinkMeasurement(y.position.copy(), y.velocity.copy(), **more)
    attitude = np.concatenate([y.position[3:], y.body.attitude])
    return LinkMeasurement(y.position[:3].copy(), np.concatenate([y.velocity, y.body.nu]), attitude, **more)


def _first(part: Realization, start: tuple[Outputs, Outputs]) -> tuple[_State, _Observed]:
    """State and observation at time zero, with no input."""
    x = part.loop.plant.initial_state(*start)
    measuring = part.initial_measuring(x)
    still = jnp.zeros(part.loop.plant.inputs())
    return _observed(part, _State(x, measuring.navigation, measuring.faults), jnp.zeros(()), still)


def _observed(part: Realization, state: _State, t: Time, applied: Float[Array, " m"]) -> tuple[_State, _Observed]:
    """State after the reading at a time, and what is observed."""
    # Without expected values in place of readings that are not finite: the controller has them.
    measuring = MeasurementState(state.navigation, None, state.faults)
    y, measuring = part.read(t, part.loop.plant.output(t, state.plant), measuring)
    state = state._replace(navigation=measuring.navigation, faults=measuring.faults)
    return state, _Observed(y, applied, status_of(part.loop, state.plant, ()))
