"""Everything that may be wrong with a measurement, as numbers: one compiled program for all of it."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.contracts import AbstractNavigation, Measurement
from undertow.core.measurement import with_outputs
from undertow.core.param import param


class RoughState(NamedTuple):
    """What it remembers."""

    step: Int[Array, ""]
    past: Float[Array, "depth 2 n"]  # readings, the newest first
    held: Float[Array, "2 n"]  # what was told last


class RoughSensor(AbstractNavigation):
    """Velocity with noise, bias and resolution; position and velocity late, and told every so many steps only.

    The noise is drawn beforehand, which is quicker than drawing at every step, and repeats after `samples` steps.
    """

    noise: Float[Array, ""] = param("m/s, rad/s", "standard deviation on velocity", default=0.0)
    position_noise: Float[Array, ""] = param("m, rad", "standard deviation on position", default=0.0)
    bias: Float[Array, ""] = param("m/s, rad/s", "constant error of velocity", default=0.0)
    resolution: Float[Array, ""] = param("m/s, rad/s", "of velocity; 0 for exact", default=0.0)
    delay: Float[Array, ""] = param("steps", "age of what is told, at most `depth` - 1", default=0.0)
    every: Float[Array, ""] = param("steps", "between readings", default=1.0)
    axes: int = eqx.field(static=True, default=6)
    samples: int = eqx.field(static=True, default=10_007)
    depth: int = eqx.field(static=True, default=16)
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key) -> Float[Array, "samples 2 n"]:
        return jax.random.normal(key, (self.samples, 2, self.axes), dtype=self.noise.dtype)

    def init(self, realization, truth: Measurement) -> RoughState:
        now = jnp.stack([truth.position, truth.velocity])
        return RoughState(jnp.zeros((), dtype=int), jnp.broadcast_to(now, (self.depth, *now.shape)), now)

    def measure(self, realization, state: RoughState, t, truth: Measurement):
        chance = realization[state.step % self.samples]
        velocity = truth.velocity + self.bias + self.noise * chance[1]
        step = jnp.where(self.resolution > 0, self.resolution, 1.0)
        velocity = jnp.where(self.resolution > 0, step * jnp.round(velocity / step), velocity)
        now = jnp.stack([truth.position + self.position_noise * chance[0], velocity])
        past = jnp.concatenate([now[None], state.past[:-1]])
        fresh = state.step % self.every.astype(int) == 0
        held = jnp.where(fresh, past[self.delay.astype(int)], state.held)
        told = with_outputs(truth, held[0], held[1])
        return told, RoughState(state.step + 1, past, held)
