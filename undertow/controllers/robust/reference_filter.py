"""A reference that may jump, made smooth: three equal poles, no lag behind what is smooth already."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, Outputs, Target
from undertow.core.param import param


class FilterState(NamedTuple):
    """What is left of earlier jumps, and what the reference should be by now if it has not jumped again."""

    offset: Target
    expected: Target  # its acceleration is the last one that was seen
    elapsed: Float[Array, ""]  # s, since then


class Room(NamedTuple):
    """What the actuators can do, and by how much a vehicle that was carried away is out of their reach."""

    most: Outputs | float  # acceleration, m/s^2, rad/s^2
    excess: Outputs | float  # of the target's lead, m, rad: the target gives way by it
    pace: Outputs | float  # of the target's velocity where it gives way: it starts from that of the vehicle


UNLIMITED = Room(1e12, 0.0, 0.0)  # infinity has no gradient

# Largest acceleration of (p + w)^3 = 0 from rest, as a share of w^2 times the way: (sqrt(2) - 1) / exp(2 - sqrt(2)).
_PEAK = 0.2306
_NEAR, _LEAST = 1e-9, 1e-9  # m, rad; m/s^2, rad/s^2: a root has no gradient at zero


class ReferenceFilter(eqx.Module):
    """Jumps of position and velocity die out like (p + w)^3 = 0, in closed form, at whatever sampling time.

    What is a jump is told from the derivatives that come with a reference: a smooth one departs from what they lead
    to by the third power of the sampling time, and passes as it is. Jumps of the acceleration pass, too.

    Raises:
        BadInput: frequency not positive.
    """

    frequency: Float[Array, "..."] = param("rad/s", "of the three poles", symbol="w_r")

    def __check_init__(self):
        checks.positive("frequency", self.frequency, "rad/s")

    def init(self, position: Outputs) -> FilterState:
        """At rest at a position: the first reference is a jump from there."""
        still = jnp.zeros_like(position)
        return FilterState(Target(still, still, still), Target(position, still, still), jnp.zeros(()))

    def smoothed(self, state: FilterState, r: Target, coordinates: AbstractCoordinates) -> Target:
        """The reference with what is left of its jumps."""
        offset = self._offset(state, r, coordinates)
        return Target(*(own + left for own, left in zip(r, offset, strict=True)))

    def advance(
        self, state: FilterState, r: Target, coordinates: AbstractCoordinates, share, dt, room: Room = UNLIMITED
    ) -> FilterState:
        """State one sampling time later.

        Args:
            state: now.
            r: reference now.
            coordinates: know which outputs are angles.
            share: of the wanted acceleration that the actuators give; with less than 1 the filter waits.
            dt: sampling time, s.
            room: what the actuators can do.
        """
        away, rate, bend = self._offset(state, r, coordinates)
        # From far away it comes more slowly, so that the way home takes half of what the actuators can do.
        far = jnp.maximum(jnp.abs(away), _NEAR)
        w, t = jnp.minimum(self.frequency, jnp.sqrt(jnp.maximum(room.most, _LEAST) / (2 * _PEAK * far))), share * dt
        # exp(A t) = exp(-w t) (1 + N t + N^2 t^2 / 2) with N = A + w nilpotent.
        first, second = rate + w * away, bend + 2 * w * rate + w**2 * away
        third = -(w**3) * away - 3 * w**2 * rate - 2 * w * bend
        decay = jnp.exp(-w * t)
        offset = Target(
            position=decay * (away + t * first + t**2 / 2 * second) - room.excess,
            velocity=decay * (rate + t * (bend + w * rate) - w * t**2 / 2 * second) - room.pace,
            acceleration=decay * (bend + t * third + w**2 * t**2 / 2 * second),
        )
        expected = Target(
            position=r.position + dt * r.velocity + dt**2 / 2 * r.acceleration,
            velocity=r.velocity + dt * r.acceleration,
            acceleration=r.acceleration,
        )
        return FilterState(offset, expected, dt)

    def _offset(self, state: FilterState, r: Target, coordinates: AbstractCoordinates) -> Target:
        """What is left of earlier jumps, and the one that has just been seen; the acceleration rose evenly."""
        risen = r.acceleration - state.expected.acceleration
        jump = coordinates.difference(r.position, state.expected.position) - state.elapsed**2 / 6 * risen
        kick = r.velocity - state.expected.velocity - state.elapsed / 2 * risen
        return Target(state.offset.position - jump, state.offset.velocity - kick, state.offset.acceleration)
