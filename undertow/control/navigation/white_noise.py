"""White noise on position and velocity."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.control.navigation.noise_only import AbstractNoiseOnly
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.measurement import with_outputs
from undertow.core.numerics.random_keys import numbered
from undertow.core.param import Param, param


class WhiteNoise(AbstractNoiseOnly):
    """Independent Gaussian errors, new at every sample of the control loop; their key comes from the sample's number.

    Raises:
        BadInput: a standard deviation negative; at the start of a run, not one number or one per output.
    """

    position: Float[Param, "..."] = param("m, rad", "standard deviation on position")
    velocity: Float[Param, "..."] = param("m/s, rad/s", "standard deviation on velocity")

    smooth: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        checks.not_negative("position", self.position)
        checks.not_negative("velocity", self.velocity)

    def realize(self, key):
        return key

    def velocity_noise(self, dt):
        return self.velocity

    def init(self, realization, truth) -> Int[Array, ""]:
        """Samples so far."""
        for name in ("position", "velocity"):
            checks.per_axis(name, getattr(self, name), len(truth.position))
        return jnp.zeros((), dtype=int)

    def measure(self, realization, state, t, truth: Measurement):
        errors = jax.random.normal(numbered(realization, state), (2, *truth.position.shape), dtype=truth.position.dtype)
        position, velocity = truth.position + self.position * errors[0], truth.velocity + self.velocity * errors[1]
        return with_outputs(truth, position, velocity), state + 1


def white_noise(position=0.0, velocity=0.01) -> WhiteNoise:
    """Gaussian noise on every sample; meant for the sampled loop.

    Args:
        position: standard deviation, m and rad; one number or one per output.
        velocity: standard deviation, m/s and rad/s; likewise.
    """
    return WhiteNoise(position=position, velocity=velocity)
