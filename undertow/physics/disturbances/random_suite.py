"""Random sinusoids and steps, different for every seed: a random counterpart of suite U1."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.numerics.random_keys import keys_for
from undertow.core.param import Param, param

_SINUSOIDS = 3  # per axis


class RandomSuite(AbstractDisturbance):
    """On each axis three sinusoids of random frequency and phase, and random levels, each held for a time.

    Raises:
        BadInput: a size negative, a frequency or `hold` not positive, or `fastest` below `slowest`.
    """

    amplitude: Float[Param, "..."] = param("m/s^2, rad/s^2", "rms of the sinusoids together")
    slowest: Float[Param, ""] = param("rad/s", "lowest frequency")
    fastest: Float[Param, ""] = param("rad/s", "highest frequency")
    step: Float[Param, "..."] = param("m/s^2, rad/s^2", "standard deviation of the levels")
    hold: Float[Param, ""] = param("s", "time for which a level is held")
    axes: int = eqx.field(static=True, default=6)
    levels: int = eqx.field(static=True, default=31)

    def __check_init__(self):
        for name in ("amplitude", "step"):
            checks.not_negative(name, getattr(self, name), "m/s^2, rad/s^2")
        for name in ("slowest", "fastest"):
            checks.positive(name, getattr(self, name), "rad/s")
        checks.positive("hold", self.hold, "s")

    def realize(self, key):
        """Frequencies (rad/s, logarithmically uniform) and phases (rad) per axis, and levels (m/s^2, rad/s^2)."""
        keys = keys_for(key, "rates", "phases", "levels")
        shape, dtype = (self.axes, _SINUSOIDS), self.slowest.dtype
        octave = jax.random.uniform(keys["rates"], shape, dtype=dtype)
        rates = self.slowest * (self.fastest / self.slowest) ** octave
        phases = 2 * jnp.pi * jax.random.uniform(keys["phases"], shape, dtype=dtype)
        return rates, phases, self.step * jax.random.normal(keys["levels"], (self.levels, self.axes), dtype=dtype)

    def at(self, realization, t, pose, load: Load) -> Load:
        if load.acceleration.shape != (self.axes,):
            raise BadInput("axes", f"be {load.acceleration.shape[0]}, as the plant has", self.axes)
        rates, phases, levels = realization
        swing = np.sqrt(2 / _SINUSOIDS) * jnp.sin(rates * t + phases).sum(-1)
        index = jnp.clip(jnp.floor(t / self.hold), 0, self.levels - 1).astype(int)
        return load._replace(acceleration=load.acceleration + self.amplitude * swing + levels[index])

    def jumps(self, duration: float) -> tuple[float, ...]:
        times = float(self.hold) * np.arange(1, self.levels)
        return tuple(times[times < duration].tolist())


def random_suite(
    amplitude=2.0,
    slowest: float = 0.3,
    fastest: float = 10.0,
    step=2.0,
    hold: float = 2.0,
    span: float = 60.0,
    axes: int = 6,
) -> RandomSuite:
    """Lumped accelerations that are large, sudden and fast, as suite U1, but different for every seed.

    Args:
        amplitude: rms of the three sinusoids of an axis together, m/s^2 and rad/s^2; one number or one per axis.
        slowest: lowest frequency, rad/s; the logarithm of the frequency is uniformly distributed.
        fastest: highest frequency, rad/s.
        step: standard deviation of the levels, m/s^2 and rad/s^2; one number or one per axis.
        hold: time for which a level is held, s.
        span: time after which the level is constant, s.
        axes: number of outputs of the plant.
    """
    checks.positive("hold", hold, "s")
    checks.positive("span", span, "s")
    if not slowest <= fastest:
        raise BadInput("fastest", f"be at least `slowest` ({slowest:g} rad/s)", f"{fastest:g} rad/s")
    if axes < 1:
        raise BadInput("axes", "be 1 or more", axes)
    return RandomSuite(amplitude, slowest, fastest, step, hold, axes, round(span / hold) + 1)
