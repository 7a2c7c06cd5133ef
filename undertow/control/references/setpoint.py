"""A fixed goal, reached by a step or a smooth transition."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractOpenReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.motion_laws import quintic, with_rates
from undertow.core.numerics.number import Number
from undertow.core.param import Param, param


class Transition(eqx.Module):
    """Transition to a goal: a straight line in all outputs with the quintic motion law.

    Raises:
        BadInput: not finite, or a negative settling time.
    """

    settling: Float[Param, ""] = param("s", "time of the transition; 0 for a step")
    # Position at t = 0, m and rad; None for the initial position of the plant.
    start: Float[Array, " n"] | None = eqx.field(
        converter=lambda at: None if at is None else as_array(at), default=None
    )

    def __check_init__(self):
        checks.not_negative("settling", self.settling, "s")
        if self.start is not None:
            checks.finite("start", self.start)

    def to(self, goal, t) -> Target:
        """Target at time t of the transition to a goal."""
        smooth = self.settling > 0
        duration = jnp.where(smooth, self.settling, 1.0)
        share, rate, second = with_rates(lambda t: jnp.where(smooth, quintic(t / duration), 1.0), t)
        start = jnp.zeros_like(goal) if self.start is None else self.start
        change = goal - start
        return Target((1 - share) * start + share * goal, change * rate, change * second)


class Setpoint(AbstractOpenReference):
    """A constant position, from the start or from the end of a transition.

    Raises:
        BadInput: not finite, or a transition with another number of outputs.
    """

    position: Float[Param, " n"] = param("m, rad", "desired position", symbol="x_d")
    transition: Transition | None = None

    def __check_init__(self):
        checks.finite("position", self.position)
        start = None if self.transition is None else self.transition.start
        if start is not None and start.shape != self.position.shape:
            must = f"have shape {self.position.shape}, as `position` has"
            raise BadInput("start", must, f"of shape {start.shape}")

    def at(self, t) -> Target:
        if self.transition is not None:
            return self.transition.to(self.position, t)
        zero = jnp.zeros_like(self.position)
        return Target(self.position, zero, zero)

    def starting_at(self, position):
        if self.transition is None or self.transition.start is not None:
            return self
        return Setpoint(self.position, Transition(self.transition.settling, position))


def setpoint(position, settling: Number = 0.0, start=None) -> Setpoint:
    """Go to a position and stay.

    A step saturates the motors. A slow enough transition does not, and the law knows its velocity and acceleration in
    advance.

    Args:
        position: one entry per output, m and rad.
        settling: time of the transition from `start`, s; 0 for a step. Its largest velocity is 1.875 times
            distance / settling, its largest acceleration 5.77 times distance / settling^2.
        start: position at t = 0, one entry per output, m and rad; None for the initial position of the plant. A
            step ignores it.
    """
    # Without a transition the goal is a constant of the compiled loop.
    if not checks.assumed(lambda time: time != 0, settling):
        return Setpoint(position)
    return Setpoint(position, Transition(settling, start))
