"""Control steps and recording, which the fixed-step loops have in common."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.contracts import Inputs
from undertow.core.numerics.number import Number
from undertow.core.status import Status
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.outcome import Ending, status_of, wrong_input
from undertow.simulation.loop.recorded_signals import Signals


def record(
    realization: Realization,
    control_step: Callable[[Any, Int[Array, ""]], Any],
    carry: Any,
    dt: Float[Array, ""],
    steps: int,
    every: int,
) -> tuple[Any, tuple[Float[Array, " records"], Signals]]:
    """Run `steps` steps and record every `every`-th instant, the first included.

    Args:
        realization: closed loop to run.
        control_step: carry and number k of the control step -> carry one step later.
        carry: carried between control steps; the states (x, z, ...) first.
        dt: time between steps, s.
        steps: how many.
        every: steps per record.
    """

    def block(carry, first):
        """Record, then run to the next record or to the end."""
        t, until = instant(first, dt), jnp.minimum(first + every, steps)
        sample = realization.record(t, *carry[0])
        return jax.lax.fori_loop(first, until, lambda k, c: control_step(c, k), carry), (t, sample)

    return jax.lax.scan(block, carry, jnp.arange(0, steps + 1, every))


def freeze_on_failure(
    loop: ClosedLoop,
    old: Any,
    new: Any,
    ending: Ending,
    t: Float[Array, ""],
    dt: Float[Array, ""],
    command: Inputs | None = None,
) -> tuple[Any, Ending]:
    """States (x, z, ...) at t + dt: the new ones, or the last valid ones after a failure.

    Args:
        loop: closed loop.
        old, new: states before and after.
        ending: of the run so far.
        t, dt: s.
        command: of the control step, where a command that is not finite ends the run.
    """
    code = status_of(loop, *new[:2])
    time = t + dt
    input_number = jnp.zeros((), dtype=int)
    if command is not None:
        input_number = wrong_input(command)
        code = jnp.where(input_number > 0, int(Status.COMMAND_NOT_FINITE), code)
        time = jnp.where(input_number > 0, t, time)
    failing = (ending.status == int(Status.OK)) & (code != int(Status.OK))
    ending = Ending(
        *(jnp.where(failing, now, was) for now, was in zip((code, time, input_number), ending, strict=True))
    )
    valid = ending.status == int(Status.OK)
    return jax.tree.map(lambda n, o: jnp.where(valid, n, o), new, old), ending


def instant(control_step: Int[Array, ""] | int, dt: Number) -> Float[Array, ""]:
    """Time of a control step, s."""
    return jnp.asarray(control_step, dtype=float) * dt
