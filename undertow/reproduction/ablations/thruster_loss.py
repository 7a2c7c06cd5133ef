"""Thrusters that give less than they are believed to: which ones is drawn by chance."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, Factors, Load
from undertow.core.param import param
from undertow.disturbances.adding import with_factors


class ThrusterLoss(AbstractDisturbance):
    """From `time` on, `number` thrusters drawn by chance give `left` times their thrust; nobody is told."""

    left: Float[Array, ""] = param("", "share that is left; 0 for off, -1 for reversed", default=1.0)
    number: Float[Array, ""] = param("", "how many thrusters", default=1.0)
    time: Float[Array, ""] = param("s", "when", default=2.0)
    thrusters: int = eqx.field(static=True, default=8)

    def draw(self, key) -> Float[Array, " N"]:
        """Share that is left of each."""
        place = jax.random.permutation(key, self.thrusters).astype(self.left.dtype)
        return jnp.where(place < self.number, self.left, 1.0)

    def at(self, path, t, place, calm: Load) -> Load:
        one = jnp.ones(())
        return with_factors(calm, place, Factors(one, one, one, jnp.where(t >= self.time, path, 1.0)))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return (float(self.time),) if 0 < float(self.time) < duration else ()
