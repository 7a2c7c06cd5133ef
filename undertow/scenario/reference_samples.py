"""A reference at instants of a run, and where the plant starts."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractReference
from undertow.core.kept_programs import briefly_compiled
from undertow.simulation.loop.closed_loop import ClosedLoop

SAMPLES = 201  # instants at which a reference is looked at


class ReferenceSamples(NamedTuple):
    """A reference at instants, and where the plant starts."""

    time: Float[np.ndarray, " k"]  # s
    position: Float[np.ndarray, "k n"]  # m, rad
    velocity: Float[np.ndarray, "k n"]  # m/s, rad/s
    start: Float[np.ndarray, " n"]  # position of the plant at t = 0


def desired_motion(loop: ClosedLoop, duration: float, start: list[float] | None) -> ReferenceSamples:
    """The reference of a loop, from 0 to `duration` (s); `start` is the initial position, None for zero."""
    at_start, _ = loop.outputs_at_start(start, None)
    return samples_at(loop.reference, np.linspace(0.0, duration, SAMPLES), np.asarray(at_start, dtype=float))


def samples_at(reference: AbstractReference, time: np.ndarray, start: np.ndarray) -> ReferenceSamples:
    """A reference at given instants, s."""
    at = _targets(reference, as_array(time))
    return ReferenceSamples(time, np.asarray(at.position, dtype=float), np.asarray(at.velocity, dtype=float), start)


@briefly_compiled
def _targets(reference: AbstractReference, times):
    return jax.lax.map(reference.at, times)
