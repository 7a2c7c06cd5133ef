"""Motion of the recent past, for readings that arrive late."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import Quaternion, Vector3

_SLOTS = 16  # cubic interpolation between so few is off by micrometres in waves, also over seconds


class Past(NamedTuple):
    """Motion some time ago, relative to that of now."""

    displacement: Vector3  # m, world: from where the body would have been at the velocity of now
    velocity: Vector3  # m/s, world: minus that of now
    attitude: Quaternion  # body -> the world of `MotionHistory.attitude`


class MotionHistory(NamedTuple):
    """Motion at some instants of the past, relative to that of now, as gyroscopes and accelerometers measured it.

    So a correction of the present estimate corrects the past as well: that of the velocity moves it by its age times
    the correction. Everything stays small, which single precision needs. Slots are ordered by age.
    """

    age: Float[Array, " slots"]  # s
    displacement: Float[Array, "slots 3"]
    velocity: Float[Array, "slots 3"]
    attitudes: Float[Array, "slots 4"]
    attitude: Quaternion  # now, in a world that gyroscopes keep: corrections do not turn it

    def after(self, elapsed: Number, acceleration: Vector3, attitude: Quaternion, spacing: Number) -> "MotionHistory":
        """The history `elapsed` (s) later.

        Args:
            elapsed: s.
            acceleration: meanwhile, m/s^2, world.
            attitude: afterwards, without corrections.
            spacing: between two slots, s.
        """
        velocity_gain = elapsed * acceleration[None]
        age = self.age + elapsed
        # Relative to the new velocity, which is larger by what was gained, an old place lies ahead.
        displacement = self.displacement + (self.age + elapsed / 2)[:, None] * velocity_gain
        old = age, displacement, self.velocity - velocity_gain, self.attitudes
        now = jnp.zeros(()), jnp.zeros(3), jnp.zeros(3), attitude
        due = age[0] >= spacing
        shifted = [
            jnp.where(due, jnp.concatenate([jnp.asarray(new)[None], slots[:-1]]), slots)
            for new, slots in zip(now, old, strict=True)
        ]
        return MotionHistory(*shifted, attitude=attitude)

    def at(self, age: Number) -> Past:
        """The motion `age` (s) ago, by cubic interpolation; the oldest kept one before that."""
        newer = jnp.concatenate([jnp.zeros(1), self.age[:-1]])
        enclosing = ((newer <= age) & (age < self.age))[:, None]
        beyond = age >= self.age[-1]
        before = lambda values, now: jnp.concatenate([now[None], values[:-1]])
        in_slot = lambda values: jnp.where(enclosing, values, 0.0).sum(0)
        zero = jnp.zeros(3)
        start, end = in_slot(newer[:, None])[0], in_slot(self.age[:, None])[0]
        length = jnp.where(beyond, 1.0, end - start)
        s = jnp.where(beyond, 0.0, (age - start) / length)
        p0, p1 = in_slot(before(self.displacement, zero)), in_slot(self.displacement)
        v0, v1 = in_slot(before(self.velocity, zero)), in_slot(self.velocity)
        # Hermite's cubic; the displacement falls with age at the rate of the velocity.
        m0, m1 = -length * v0, -length * v1
        position = p0 + s * (m0 + s * (3 * (p1 - p0) - 2 * m0 - m1 + s * (2 * (p0 - p1) + m0 + m1)))
        rate = m0 + s * (6 * (p1 - p0) - 4 * m0 - 2 * m1 + 3 * s * (2 * (p0 - p1) + m0 + m1))
        q0, q1 = in_slot(before(self.attitudes, self.attitude)), in_slot(self.attitudes)
        turned = (1 - s) * q0 + s * jnp.where((q0 * q1).sum() < 0, -q1, q1)
        turned = jnp.where(beyond, self.attitudes[-1], turned)
        attitude = turned / jnp.sqrt((turned * turned).sum())
        return Past(
            jnp.where(beyond, self.displacement[-1], position),
            jnp.where(beyond, self.velocity[-1], -rate / length),
            attitude,
        )


def resting(attitude: Quaternion) -> MotionHistory:
    """The history of a body that has not moved."""
    still = jnp.zeros((_SLOTS, 3))
    return MotionHistory(jnp.zeros(_SLOTS), still, still, jnp.broadcast_to(attitude, (_SLOTS, 4)), attitude)


def spacing_for(longest: Number) -> Number:
    """Spacing, s, with which the history reaches back to the longest age, s."""
    return longest / (_SLOTS - 2)
