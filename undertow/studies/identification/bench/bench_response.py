"""What a thruster does on a bench: settled at many voltages, and over time; with any thruster of the catalogue."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.numerics.integrators import rk4
from undertow.physics.thrusters.thruster import AbstractThruster

Rows = Float[Array, " rows"]

_LONGEST_STEP = 5e-3  # s
_MOST_STEPS = 40_000
_SETTLING = (4.0, 2e-3)  # s: how long a thruster gets to settle, and the step


class BenchResponse(NamedTuple):
    """What a bench would measure: thrust (N), current of the motor (A) and speed (rad/s); zeros without a speed."""

    thrust: Rows
    current: Rows
    speed: Rows


class HeldCommand(NamedTuple):
    """Volts of a record on an even grid, each held until the next.

    Attributes:
        volts: V, (steps,).
        step: s.
        times: of the rows of the record, s, (rows,).
    """

    volts: Float[np.ndarray, " steps"]
    step: float
    times: Float[np.ndarray, " rows"]


def held_command(volts: np.ndarray, times: np.ndarray) -> HeldCommand:
    """Commands of a record on a grid that is fine enough for lags of a hundredth of a second."""
    duration = float(times[-1])
    step = max(min(float(np.median(np.diff(times))), _LONGEST_STEP), duration / _MOST_STEPS)
    grid = step * np.arange(int(np.ceil(duration / step)) + 1)
    rows = np.clip(np.searchsorted(times, grid + 1e-9 * step, side="right") - 1, 0, None)
    return HeldCommand(volts[rows], step, times)


def settled_response(thruster: AbstractThruster, volts: Rows) -> BenchResponse:
    """What a thruster settles to at each voltage: each is given to one thruster of many, for some seconds."""
    duration, step = _SETTLING
    state = thruster.initial_state(len(volts))
    field = lambda t, y: thruster.dynamics(y, volts)
    advance = lambda state, _: (rk4(field, jnp.zeros(()), state, step), None)
    state, _ = jax.lax.scan(advance, state, None, length=round(duration / step))
    return response_of(thruster, state, volts)


def response_over_time(
    thruster: AbstractThruster, begin: Any, command: HeldCommand, delay: Float[Array, ""] | float = 0.0
) -> BenchResponse:
    """What a thruster does with a record's commands, which reach it later by a delay (s).

    Args:
        thruster: of one motor.
        begin: its state at the first row.
        command: of the record.
        delay: s.
    """

    def advance(state, volts):
        now = response_of(thruster, state, volts)
        after = rk4(lambda t, y: thruster.dynamics(y, volts), jnp.zeros(()), state, command.step)
        return after, now

    _, series = jax.lax.scan(advance, begin, jnp.asarray(command.volts)[:, None])
    grid = jnp.asarray(command.step * np.arange(len(command.volts)))
    times = jnp.asarray(command.times) - delay
    return BenchResponse(*(jnp.interp(times, grid, values[:, 0]) for values in series))


def response_of(thruster: AbstractThruster, state: Any, volts: Rows) -> BenchResponse:
    """What a bench measures in a state."""
    report = thruster.report(state)
    thrust = thruster.thrust(state, volts)
    speed = jnp.zeros_like(volts) if report is None else report.speed
    return BenchResponse(thrust, thruster.current(state, volts) * jnp.ones_like(volts), speed)
