"""Waves: motion of the water at depth under a JONSWAP sea state."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number
from undertow.core.numerics.random_keys import keys_for
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import body_of, with_surface, with_water

# Frequencies in units of the peak frequency; the range holds all but 1e-4 of the energy.
_LOWEST, _HIGHEST, _POINTS = 0.4, 8.0, 4000


def spectrum(frequency: Float[Array, "..."], period: Number, peakedness: Number) -> Float[Array, "..."]:
    """Energy per frequency, up to a factor; Hasselmann et al. (1973).

    Args:
        frequency: rad/s.
        period: of the peak, s.
        peakedness: gamma; 1 gives Pierson-Moskowitz.
    """
    ratio = frequency * period / (2 * jnp.pi)
    width = jnp.where(ratio <= 1, 0.07, 0.09)
    peak = jnp.exp(-((ratio - 1) ** 2) / (2 * width**2))
    return ratio**-5 * jnp.exp(-1.25 * ratio**-4) * peakedness**peak


def frequencies_of_shares(
    share: Float[Array, " k"], period: Float[Array, ""], peakedness: Float[Array, ""]
) -> Float[Array, " k"]:
    """Frequencies (rad/s) below which these shares of the energy are."""
    grid = jnp.linspace(_LOWEST, _HIGHEST, _POINTS) * 2 * jnp.pi / period
    density = spectrum(grid, period, peakedness)
    below = jnp.concatenate([jnp.zeros(1), jnp.cumsum((density[1:] + density[:-1]) / 2)])
    return jnp.interp(share, below / below[-1], grid)


_GRAVITY = 9.81  # m/s^2
_SHARES = 2000  # of the energy, for the orbital speed


class Sea(NamedTuple):
    """One realization: long-crested waves of equal amplitude."""

    frequency: Float[Array, " k"]  # rad/s
    phase: Float[Array, " k"]  # rad
    heading: Float[Array, " k"]  # direction of propagation, rad from north


class Waves(AbstractDisturbance):
    """Linear (Airy) waves in deep water, as a sum of components that carry equal shares of the energy.

    Orbital velocity and acceleration decay as e^(-k depth). The water is assumed uniform over the vehicle, which is
    valid for waves much longer than the vehicle. Above it the surface has the elevation of these waves.

    Raises:
        BadInput: height or period not positive, peakedness below 1, spreading negative.
    """

    height: Float[Param, ""] = param("m", "significant wave height", symbol="H_s")
    period: Float[Param, ""] = param("s", "peak period", symbol="T_p")
    heading: Float[Param, ""] = param("rad", "direction of propagation, from north")
    spreading: Float[Param, ""] = param("rad", "standard deviation of the heading")
    peakedness: Float[Param, ""] = param("", "peak enhancement", symbol="gamma")
    depth: Float[Param, ""] = param("m", "depth of the world's origin")
    components: int = eqx.field(static=True, default=32)

    def __check_init__(self):
        for name, unit in (("height", "m"), ("period", "s")):
            checks.positive(name, getattr(self, name), unit)
        checks.finite("heading", self.heading, "rad")
        checks.finite("depth", self.depth, "m")
        checks.not_negative("spreading", self.spreading, "rad")
        checks.positive("peakedness", self.peakedness)

    def realize(self, key) -> Sea:
        """Random frequencies, each within its share of the energy, random phases, and headings about the mean."""
        keys = keys_for(key, "shares", "phases", "headings")
        kind = self.height.dtype
        uniform = jax.random.uniform(keys["shares"], (self.components,), dtype=kind)
        share = (jnp.arange(self.components, dtype=kind) + uniform) / self.components
        return Sea(
            frequency=frequencies_of_shares(share, self.period, self.peakedness),
            phase=jax.random.uniform(keys["phases"], (self.components,), dtype=kind, maxval=2 * jnp.pi),
            heading=self.heading + self.spreading * jax.random.normal(keys["headings"], (self.components,), dtype=kind),
        )

    def at(self, realization: Sea, t, pose, load: Load) -> Load:
        north, east, down = body_of(pose).position
        amplitude = self.height / 4 * math.sqrt(2 / self.components)  # m; sum of a^2 / 2 = (H_s / 4)^2
        number = realization.frequency**2 / _GRAVITY  # 1/m, deep water
        cosine, sine = jnp.cos(realization.heading), jnp.sin(realization.heading)
        angle = number * (north * cosine + east * sine) - realization.frequency * t + realization.phase
        speed = amplitude * realization.frequency * jnp.exp(-number * jnp.maximum(self.depth + down, 0.0))
        along, up = speed * jnp.cos(angle), speed * jnp.sin(angle)
        velocity = jnp.stack([(along * cosine).sum(), (along * sine).sum(), -up.sum()])
        gain_along, gain_up = realization.frequency * up, -realization.frequency * along
        acceleration = jnp.stack([(gain_along * cosine).sum(), (gain_along * sine).sum(), -gain_up.sum()])
        load = with_surface(load, pose, self.depth, (amplitude * jnp.cos(angle)).sum())
        return with_water(load, pose, velocity, acceleration)

    def orbital_speed(self, depth: Float[Array, ""]) -> Float[Array, ""]:
        """Standard deviation (m/s) of the water's velocity along the heading, which is that of the vertical velocity.

        Args:
            depth: below the still surface, m; not negative.
        """
        share = (jnp.arange(_SHARES, dtype=self.height.dtype) + 0.5) / _SHARES
        frequency = frequencies_of_shares(share, self.period, self.peakedness)
        decay = jnp.exp(-2 * frequency**2 / _GRAVITY * depth)
        return self.height / 4 * jnp.sqrt((frequency**2 * decay).mean())

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def waves(height=0.5, period=5.0, heading=0.0, spreading=0.0, peakedness=3.3, depth=3.0, components: int = 32) -> Waves:
    """Sea state by its JONSWAP spectrum (Hasselmann et al. 1973); another realization for every seed.

    Args:
        height: significant wave height, m.
        period: peak period, s.
        heading: direction of propagation, rad from north.
        spreading: standard deviation of the heading, rad.
        peakedness: 3.3 for a young sea, 1 for a fully developed one (Pierson-Moskowitz).
        depth: of the world's origin below the surface, m.
        components: number of waves, 1 to 100.
    """
    if components < 1:
        raise BadInput("components", "be 1 or more", components)
    return Waves(height, period, heading, spreading, peakedness, depth, components)
