"""Readings that are stuck: the same bits again and again, although the other readings tell of motion.

A position is stuck if the measured velocity adds up to a motion that it does not show, and a velocity if the measured
position moves otherwise than it says. Equal readings of a vehicle at rest are no fault.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from undertow.core.param import Param, param
from undertow.numerics.rotations import attitude_error
from undertow.supervision.motion import Motion, length, split

Scalar = Float[Array, ""]


class Anchor(NamedTuple):
    """The instant since which readings have the same bits, for translation and rotation, and the motion since."""

    position: Array  # m, then
    attitude: Array  # then
    moved: Array  # integral of the velocity since, m
    turned: Array  # integral of the angular velocity since, rad
    same: Float[Array, "2"]  # readings with the same bits: translation, rotation


class StuckState(NamedTuple):
    """State of the search."""

    read: Motion  # last reading
    pose: Anchor  # since position and attitude have not changed
    rates: Anchor  # since velocity and angular velocity have not


class Stuck(NamedTuple):
    """Which readings are stuck."""

    position: Bool[Array, ""]
    attitude: Bool[Array, ""]
    velocity: Bool[Array, ""]
    rates: Bool[Array, ""]
    missing: Scalar  # largest missing motion relative to its limit, of readings that have the same bits


class StuckReadings(eqx.Module):
    """How long readings may have the same bits, and how far the others may tell of motion meanwhile."""

    distance: Float[Param, ""] = param("m", "missing motion from which on equal readings are stuck")
    angle: Float[Param, ""] = param("rad", "the same of rotation")
    readings: Float[Param, ""] = param("", "number of equal readings from which on they may be stuck")

    def init(self, read: Motion) -> StuckState:
        """State at the first reading."""
        moved, turned = jnp.zeros_like(read.position), jnp.zeros_like(split(read.velocity)[1])
        read = _finite(read)
        anchor = Anchor(read.position, read.attitude, moved, turned, jnp.zeros(2))
        return StuckState(read, anchor, anchor)

    def after(self, state: StuckState, read: Motion, path: tuple[Array, Array], dt: Scalar) -> StuckState:
        """State at a reading, `dt` (s) after the last one.

        Args:
            state: at the last reading.
            read: the reading as it came.
            path: believed velocity of the position and angular velocity since the last reading, m/s and rad/s.
            dt: s.
        """
        before, now = split(state.read.velocity), split(read.velocity)
        pose = (read.position == state.read.position).all(), (read.attitude == state.read.attitude).all()
        rates = (now[0] == before[0]).all(), (now[1] == before[1]).all()
        read = _finite(read)
        go_on = lambda anchor, same: _go_on(anchor, same, read, path, dt)
        return StuckState(read, go_on(state.pose, pose), go_on(state.rates, rates))

    def found(self, state: StuckState) -> Stuck:
        """Which readings are stuck now."""
        of_pose, of_rates = self._missing(state.pose, state.read), self._missing(state.rates, state.read)
        missing = jnp.stack([*of_pose, *of_rates]).max()
        return Stuck(of_pose[0] > 1, of_pose[1] > 1, of_rates[0] > 1, of_rates[1] > 1, missing)

    def _missing(self, anchor: Anchor, read: Motion) -> tuple[Scalar, Scalar]:
        """Missing translation and rotation, relative to their limits; 0 while bits change."""
        same = anchor.same >= self.readings
        straight = length(read.position - anchor.position - anchor.moved) / self.distance
        turn = jnp.zeros(())
        if read.attitude.shape[0]:
            turn = length(attitude_error(read.attitude, anchor.attitude) - anchor.turned) / self.angle
        known = lambda same, size: jnp.where(same & jnp.isfinite(size), size, 0.0)
        return known(same[0], straight), known(same[1], turn)


def _go_on(anchor: Anchor, same: tuple, read: Motion, path: tuple[Array, Array], dt: Scalar) -> Anchor:
    (straight, turning), (moved, turned) = same, path
    return Anchor(
        jnp.where(straight, anchor.position, read.position),
        jnp.where(turning, anchor.attitude, read.attitude),
        jnp.where(straight, anchor.moved + dt * moved, 0.0),
        jnp.where(turning, anchor.turned + dt * turned, 0.0),
        jnp.where(jnp.stack([straight, turning]), anchor.same + 1, 0.0),
    )


def _finite(read: Motion) -> Motion:
    """A reading with zeros for what is not finite, as the state of a run must be; NaN is never equal to them."""
    return Motion(*(jnp.where(jnp.isfinite(entry), entry, 0.0) for entry in read))
