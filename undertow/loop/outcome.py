"""What a loop hands back, and how failure travels through compiled code."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop, Sample


class Outcome(NamedTuple):
    """One run: what was recorded, what was accumulated, how it ended."""

    time: Float[Array, " records"]  # s
    samples: Sample  # one entry per record, the end included
    accumulated: Any  # final states of the accumulators
    final: Any  # states (x, z) of plant and controller at the end
    status: Int[Array, ""]  # a Status code
    ended: Float[Array, ""]  # s; when it failed, else the duration


def health(loop: ClosedLoop, x: PyTree, z: PyTree) -> Array:
    """Status code of an instant; what the controller's model can bear is no failure."""
    finite = jnp.stack([_finite(leaf).all() for leaf in jax.tree.leaves((x, z))]).all()
    code = loop.plant.health(x)
    for borne in loop.controller.model.bears():
        code = jnp.where(code == int(borne), int(Status.OK), code)
    return jnp.where(finite, code, int(Status.NOT_FINITE))


def _finite(leaf: Array) -> Array:
    """Which numbers have a square, as metrics need it; a filter may grow for long before it overflows."""
    if not jnp.issubdtype(leaf.dtype, jnp.floating):
        return jnp.isfinite(leaf)
    return jnp.abs(leaf) < jnp.sqrt(jnp.finfo(leaf.dtype).max)
