"""Time since a law began, exact over long runs: what laws need that follow rows of a file."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

# Share of an interval between rows by which one counts early: times of steps are sums, and may be a rounding below.
EARLY = 1e-2


class ElapsedTime(NamedTuple):
    """Time since the begin, and what rounding has taken from it (Kahan's summation)."""

    time: Float[Array, ""]  # s
    rest: Float[Array, ""]  # s

    def after(self, dt: Float[Array, ""]) -> "ElapsedTime":
        """The time a step of dt (s) later."""
        step = dt - self.rest
        time = self.time + step
        return ElapsedTime(time, (time - self.time) - step)


def time_at_begin(like: Array) -> ElapsedTime:
    """Zero, of the type of an array."""
    zero = jnp.zeros_like(like[0])
    return ElapsedTime(zero, zero)
