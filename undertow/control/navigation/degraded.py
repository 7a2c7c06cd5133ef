"""Position and velocity of a poor navigation system: noise, bias, quantisation, delay and a low rate.

These are the properties of the system as it was bought: a law is designed for the noise of its velocity, and
predictions contain it. What goes wrong with a navigation system in a run, for which no law is designed, is a fault of
`position`, `velocity`, ...
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.navigation.noise_only import AbstractNoiseOnly
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.numerics.random_keys import numbered
from undertow.core.param import Param, param
from undertow.physics.sensors.sampling import Sampling, SensorState


class DegradedState(NamedTuple):
    """Samplers of position and velocity, and the last readings."""

    position: SensorState
    velocity: SensorState
    held: tuple[Array, Array]  # last delivered position (m, rad) and velocity (m/s, rad/s)


class Degraded(AbstractNoiseOnly):
    """Every output has a sensor of its own, all of the same period and delay; the last reading holds until the next.

    Before the first delivery the initial position and velocity are held.
    """

    position: Sampling
    velocity: Sampling
    position_bias: Float[Param, "..."] = param("m, rad", "constant error of position")
    velocity_bias: Float[Param, "..."] = param("m/s, rad/s", "constant error of velocity")
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key):
        return key

    def velocity_noise(self, dt):
        """The same noise density, spread over every control step."""
        return self.velocity.noise * jnp.sqrt(self.velocity.period / dt)

    def init(self, realization, truth: Measurement) -> DegradedState:
        for name, sampling in (("position", self.position), ("velocity", self.velocity)):
            given = {"noise": sampling.noise, "bias": getattr(self, f"{name}_bias"), "resolution": sampling.resolution}
            for error, value in given.items():
                checks.per_axis(f"{name}_{error}", value, len(truth.position))
        none = jnp.zeros_like(truth.position)
        held = (truth.position, truth.velocity)
        return DegradedState(self.position.init(none, none), self.velocity.init(none, none), held)

    def measure(self, realization, state: DegradedState, t, truth: Measurement):
        shape = (2, truth.position.shape[0] + 1)  # the last number decides whether a reading is lost: none is
        key = numbered(realization, self.velocity.number(t))
        chances = jax.random.normal(key, shape, dtype=truth.position.dtype)
        first, position = self.position.deliver(state.position, t, truth.position + self.position_bias, chances[0])
        second, velocity = self.velocity.deliver(state.velocity, t, truth.velocity + self.velocity_bias, chances[1])
        held: Any = tuple(
            jnp.where(new.fresh, new.reading, old) for new, old in zip((first, second), state.held, strict=True)
        )
        return truth._replace(position=held[0], velocity=held[1]), DegradedState(position, velocity, held)


def degraded(
    position_noise=0.0,
    velocity_noise=0.0,
    position_bias=0.0,
    velocity_bias=0.0,
    position_resolution=0.0,
    velocity_resolution=0.0,
    period: float | None = None,
    delay: float = 0.0,
    sampling_time: float = 1e-3,
) -> Degraded:
    """Measurements with noise, bias, quantisation and delay. For the sampled loop.

    Args:
        position_noise: standard deviation, new for every reading, m and rad; one number or one per output.
        velocity_noise: likewise of velocity, m/s and rad/s.
        position_bias: constant error, m and rad; one number or one per output.
        velocity_bias: likewise of velocity, m/s and rad/s.
        position_resolution: step of the readings, m and rad; 0 for none; one number or one per output.
        velocity_resolution: likewise of velocity, m/s and rad/s.
        period: between readings, s; None: one at every control step.
        delay: from reading to delivery, s.
        sampling_time: that of the loop, s; a scenario sets it.

    Raises:
        BadInput: a value is out of its range; at the start of a run, not one number or one per output.
    """
    checks.positive("sampling_time", sampling_time, "s")
    period = sampling_time if period is None else period
    position = Sampling(period, noise=position_noise, resolution=position_resolution, delay=delay)
    velocity = Sampling(period, noise=velocity_noise, resolution=velocity_resolution, delay=delay)
    return Degraded(position=position, velocity=velocity, position_bias=position_bias, velocity_bias=velocity_bias)
