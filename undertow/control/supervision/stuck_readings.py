"""Readings that are stuck: the same bits again and again, although the other readings tell of motion.

A position is stuck if the measured velocity adds up to a motion that it does not show, and a velocity if the measured
position moves otherwise than it says. Equal readings of a vehicle at rest are no fault. Each entry is judged by itself.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.supervision.motion import length, motion_of
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.param import Param, param

Scalar = Float[Array, ""]
Entries = Float[Array, " n"]


class StuckState(NamedTuple):
    """Last reading, and for how many readings each entry has had the same bits; what has happened meanwhile."""

    position: Entries  # last reading, outputs
    velocity: Entries  # last reading: of a vehicle in body axes
    held: Entries  # readings with the same bits, of each position
    moved: Entries  # integral of the rates since, of each position
    velocity_held: Entries  # readings with the same bits, of each velocity
    from_position: Entries  # outputs when no velocity had the same bits for the last time
    velocity_moved: Entries  # integral of the rates since then


class StuckFlags(NamedTuple):
    """Which readings are stuck: 1, else 0."""

    position: Entries  # outputs
    velocity: Entries
    missing: Scalar  # largest missing motion relative to its limit, of readings that have the same bits


class StuckReadings(eqx.Module):
    """How long readings may have the same bits, and how far the others may tell of motion meanwhile.

    Raises:
        BadInput: a limit is not positive.
    """

    distance: Float[Param, ""] = param("m", "missing motion from which on equal readings are stuck")
    angle: Float[Param, ""] = param("rad", "the same of rotation")
    readings: Float[Param, ""] = param("", "number of equal readings from which on they may be stuck")
    angles: tuple[bool, ...] = eqx.field(static=True, default=())  # which outputs are angles

    def __check_init__(self):
        for name in ("distance", "angle", "readings"):
            checks.positive(name, getattr(self, name))

    def init(self, y: Measurement) -> StuckState:
        """State at the first reading."""
        position, velocity = _finite(y.position), _finite(motion_of(y).velocity)
        zero = jnp.zeros_like(position)
        return StuckState(position, velocity, zero, zero, zero, position, zero)

    def after(self, state: StuckState, y: Measurement, rates: Entries, dt: Scalar) -> StuckState:
        """State at a reading.

        Args:
            state: at the last reading.
            y: the reading as it came.
            rates: believed rates of the outputs since the last reading, m/s and rad/s.
            dt: time since then, s.
        """
        read = motion_of(y).velocity
        same, same_rate = y.position == state.position, read == state.velocity
        position, path = _finite(y.position), dt * rates
        moving = ~same_rate.any()
        return StuckState(
            position=position,
            velocity=_finite(read),
            held=jnp.where(same, state.held + 1, 0.0),
            moved=jnp.where(same, state.moved + path, 0.0),
            velocity_held=jnp.where(same_rate, state.velocity_held + 1, 0.0),
            from_position=jnp.where(moving, position, state.from_position),
            velocity_moved=jnp.where(moving, 0.0, state.velocity_moved + path),
        )

    def found(self, state: StuckState) -> StuckFlags:
        """Which readings are stuck now."""
        turns = np.array(self.angles)
        limits = jnp.where(jnp.asarray(turns), self.angle, self.distance)
        alone = jnp.where(state.held >= self.readings, jnp.abs(state.moved) / limits, 0.0)
        departure = state.position - state.from_position
        wrapped = departure - 2 * jnp.pi * jnp.round(departure / (2 * jnp.pi))
        departure = jnp.where(jnp.asarray(turns), wrapped, departure) - state.velocity_moved
        # One axis of the body moves all outputs of its kind.
        straight, turned = (length(departure * jnp.asarray(kind, dtype=float)) for kind in (~turns, turns))
        combined = jnp.where(jnp.asarray(turns), turned / self.angle, straight / self.distance)
        combined = jnp.where(state.velocity_held >= self.readings, combined, 0.0)
        flag = lambda ratio: jnp.where(ratio > 1, 1.0, 0.0)
        return StuckFlags(flag(alone), flag(combined), jnp.maximum(alone.max(), combined.max()))


def _finite(read: Array) -> Array:
    """A reading with zeros for what is not finite, as the state of a run must be; NaN is never equal to them."""
    return jnp.where(jnp.isfinite(read), read, 0.0)
