"""How often an input goes from one of its limits to the other.

A loop that swings between the limits of its thrusters wears them out and controls nothing, whatever makes it swing:
readings that swing slowly enough to be plausible, an unknown delay, gains that are too large. The variation of its
input per second may be that of ordinary noise, which does not take an input to both limits in turn.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import Inputs

Scalar = Float[Array, ""]

AVERAGED = 3.0  # s
_AT_LIMIT = 0.95  # share of the way from the middle to a limit


class SwingState(NamedTuple):
    """What is known of the swings."""

    side: Inputs  # the limit where an input was last: 1 for the higher one, -1 for the lower one, 0 for none yet
    rate: Inputs  # swings per second, averaged


def no_swings(u: Inputs) -> SwingState:
    """Before the first input."""
    return SwingState(jnp.zeros_like(u), jnp.zeros_like(u))


def swung(state: SwingState, u: Inputs, low: Inputs, high: Inputs, elapsed: Scalar) -> SwingState:
    """State with one more input, for so long (s)."""
    faded = jnp.maximum(1 - elapsed / AVERAGED, 0.0)
    share = (2 * u - high - low) / (high - low)
    side = jnp.where(jnp.abs(share) >= _AT_LIMIT, jnp.sign(share), state.side)
    over = side * state.side < 0
    return SwingState(side, faded * state.rate + jnp.where(over, 1 / AVERAGED, 0.0))
