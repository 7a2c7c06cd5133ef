"""A reference that may jump, made smooth: three equal poles, no lag behind what is smooth already."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractModel, Target
from undertow.core.param import param


class ReferenceFilter(eqx.Module):
    """The difference to the reference dies out like (p + w)^3 = 0, in closed form, at whatever sampling time.

    Raises:
        BadInput: frequency not positive.
    """

    frequency: Float[Array, "..."] = param("rad/s", "of the three poles", symbol="w_r")

    def __check_init__(self):
        checks.positive("frequency", self.frequency, "rad/s")

    def advance(self, state: Target, r: Target, model: AbstractModel, share, dt) -> Target:
        """Filtered reference one sampling time later.

        Args:
            state: filtered reference now.
            r: reference now; its acceleration is held.
            model: knows which outputs are angles.
            share: of the wanted acceleration that the actuators give; with less than 1 the filter waits.
            dt: sampling time, s.
        """
        w, t = self.frequency, share * dt
        away = model.difference(state.position, r.position)
        rate = state.velocity - r.velocity
        bend = state.acceleration - r.acceleration
        # exp(A t) = exp(-w t) (1 + N t + N^2 t^2 / 2) with N = A + w nilpotent.
        first = rate + w * away
        second = bend + 2 * w * rate + w**2 * away
        decay = jnp.exp(-w * t)
        position = decay * (away + t * first + t**2 / 2 * second)
        velocity = decay * (rate + t * (bend + w * rate) - w * t**2 / 2 * second)
        acceleration = decay * (bend + t * (-(w**3) * away - 3 * w**2 * rate - 2 * w * bend) + w**2 * t**2 / 2 * second)
        return Target(
            position=r.position + dt * r.velocity + dt**2 / 2 * r.acceleration + position,
            velocity=r.velocity + dt * r.acceleration + velocity,
            acceleration=r.acceleration + acceleration,
        )
