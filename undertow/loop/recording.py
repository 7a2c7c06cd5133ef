"""Ticking and recording: what the fixed-step loops have in common."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop, Drawn, Sample
from undertow.loop.outcome import health


def record(
    drawn: Drawn, tick: Callable[[Any, Int[Array, ""]], Any], carry: Any, dt: Float[Array, ""], ticks: int, every: int
) -> tuple[Any, tuple[Float[Array, " records"], Sample]]:
    """Run `ticks` ticks and look at every `every`-th instant, the first included.

    Args:
        drawn: what is run.
        tick: carry and number of the tick -> carry one tick later.
        carry: what goes from tick to tick; the states (x, z, ...) first.
        dt: time between ticks, s.
        ticks: how many.
        every: ticks per record.
    """

    def block(carry, first):
        """Record, then run to the next record, or to the end."""
        t, until = instant(first, dt), jnp.minimum(first + every, ticks)
        sample = drawn.look(t, *carry[0])
        return jax.lax.fori_loop(first, until, lambda k, c: tick(c, k), carry), (t, sample)

    return jax.lax.scan(block, carry, jnp.arange(0, ticks + 1, every))


def keep_sound(
    loop: ClosedLoop, old: Any, new: Any, status: Int[Array, ""], ended: Float[Array, ""], t: Float[Array, ""]
):
    """States (x, z, ...) after a tick that ends at t: the new ones, or for ever the old ones once something is wrong.

    Returns:
        States, status and time of the end.
    """
    code = health(loop, *new[:2])
    failing = (status == int(Status.OK)) & (code != int(Status.OK))
    status, ended = jnp.where(failing, code, status), jnp.where(failing, t, ended)
    sound = status == int(Status.OK)
    return jax.tree.map(lambda n, o: jnp.where(sound, n, o), new, old), status, ended


def instant(tick: Int[Array, ""], dt: Float[Array, ""]) -> Float[Array, ""]:
    """Time of a tick, s."""
    return jnp.asarray(tick, dtype=float) * dt
