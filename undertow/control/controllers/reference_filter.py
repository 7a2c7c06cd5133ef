"""Filter of reference jumps: three equal poles, and no lag behind a smooth reference."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, Outputs, Target
from undertow.core.param import Param, param


class FilterState(NamedTuple):
    """Remainder of earlier jumps, and the expected reference if it does not jump again."""

    offset: Target
    expected: Target  # its acceleration is the last one
    elapsed: Float[Array, ""]  # s, since then


class Room(NamedTuple):
    """Limits of the actuators, and by how much the error of a vehicle that drifted away exceeds them."""

    most: Outputs | float  # acceleration, m/s^2, rad/s^2
    excess: Outputs | float  # of the error, m, rad: the target is moved by it
    pace: Outputs | float  # change of the target's velocity where it is moved: it starts from that of the vehicle


UNLIMITED = Room(1e12, 0.0, 0.0)  # infinity has no gradient

# Largest acceleration of (p + w)^3 = 0 from rest, as a share of w^2 times the step: (sqrt(2) - 1) / exp(2 - sqrt(2)).
_PEAK = 0.2306
_NEAR, _LEAST = 1e-9, 1e-9  # m, rad; m/s^2, rad/s^2: a root has no gradient at zero


class ReferenceFilter(eqx.Module):
    """Jumps of position and velocity decay by (p + w)^3 = 0, in closed form, at any sampling time.

    A jump is a difference from the extrapolation of the reference's derivatives: a smooth reference differs from it by
    the third power of the sampling time, and passes unchanged. Jumps of the acceleration pass, too.

    Raises:
        BadInput: frequency not positive.
    """

    frequency: Float[Param, "..."] = param("rad/s", "frequency of the three poles", symbol="w_r")

    def __check_init__(self):
        checks.positive("frequency", self.frequency, "rad/s")

    def init(self, position: Outputs) -> FilterState:
        """State at rest at a position: the first reference is a jump from there."""
        still = jnp.zeros_like(position)
        return FilterState(Target(still, still, still), Target(position, still, still), jnp.zeros(()))

    def smoothed(self, state: FilterState, r: Target, coordinates: AbstractCoordinates) -> Target:
        """The reference with the remainder of its jumps."""
        offset = self._offset(state, r, coordinates)
        return Target(*(reference + remainder for reference, remainder in zip(r, offset, strict=True)))

    def advance(
        self, state: FilterState, r: Target, coordinates: AbstractCoordinates, share, dt, room: Room = UNLIMITED
    ) -> FilterState:
        """State one sampling time later.

        Args:
            state: now.
            r: reference now.
            coordinates: say which outputs are angles.
            share: share of the desired acceleration that the actuators give; below 1 the filter waits.
            dt: sampling time, s.
            room: limits of the actuators.
        """
        away, rate, bend = self._offset(state, r, coordinates)
        # From far away it is slower, so that the return takes half of the authority of the actuators.
        distance = jnp.maximum(jnp.abs(away), _NEAR)
        w = jnp.minimum(self.frequency, jnp.sqrt(jnp.maximum(room.most, _LEAST) / (2 * _PEAK * distance)))
        t = share * dt
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
        """Remainder of earlier jumps and of a new one; the acceleration is taken as linear in between."""
        risen = r.acceleration - state.expected.acceleration
        jump = coordinates.difference(r.position, state.expected.position) - state.elapsed**2 / 6 * risen
        kick = r.velocity - state.expected.velocity - state.elapsed / 2 * risen
        return Target(state.offset.position - jump, state.offset.velocity - kick, state.offset.acceleration)
