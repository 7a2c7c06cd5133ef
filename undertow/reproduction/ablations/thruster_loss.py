"""Thrusters that give less than they are believed to: which ones is drawn by chance."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, Load, ModelScaling
from undertow.core.param import param
from undertow.disturbances.adding import with_scaling


class ThrusterLoss(AbstractDisturbance):
    """From `time` on, `number` thrusters drawn by chance give `left` times their thrust; nobody is told."""

    left: Float[Array, ""] = param("", "share that is left; 0 for off, -1 for reversed", default=1.0)
    number: Float[Array, ""] = param("", "how many thrusters", default=1.0)
    time: Float[Array, ""] = param("s", "when", default=2.0)
    thrusters: int = eqx.field(static=True, default=8)

    def realize(self, key) -> Float[Array, " N"]:
        """Share that is left of each."""
        pose = jax.random.permutation(key, self.thrusters).astype(self.left.dtype)
        return jnp.where(pose < self.number, self.left, 1.0)

    def at(self, realization, t, pose, load: Load) -> Load:
        one = jnp.ones(())
        return with_scaling(load, pose, ModelScaling(one, one, one, jnp.where(t >= self.time, realization, 1.0)))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return (float(self.time),) if 0 < float(self.time) < duration else ()
