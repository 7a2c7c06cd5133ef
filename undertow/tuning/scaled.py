"""A scaled disturbance."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, Load, ModelScaling, Payload, Water
from undertow.core.param import param


class Scaled(AbstractDisturbance):
    """`size` times a disturbance: loads and water in proportion, factors on the body as powers."""

    inner: AbstractDisturbance
    size: Float[Array, ""] = param("", "1 leaves the disturbance as it is")

    def realize(self, key):
        return self.inner.realize(key)

    def at(self, realization, t, pose, load: Load) -> Load:
        whole, size = self.inner.at(realization, t, pose, load), self.size
        water, factors = whole.water, whole.scaling
        return Load(
            acceleration=load.acceleration + size * (whole.acceleration - load.acceleration),
            wrench=load.wrench + size * (whole.wrench - load.wrench),
            water=water and Water(size * water.velocity, size * water.acceleration),
            scaling=factors and ModelScaling(*(factor**size for factor in factors)),
            payloads=tuple(Payload(size * each.mass, size * each.weight, each.point) for each in whole.payloads),
        )

    def jumps(self, duration: float) -> tuple[float, ...]:
        return self.inner.jumps(duration)


def scaled(inner: AbstractDisturbance, size) -> Scaled:
    """A disturbance times a size, which may be traced."""
    return Scaled(inner, jnp.asarray(size, dtype=float))
