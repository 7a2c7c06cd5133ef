"""Suite U1: large, sudden and fast; one signal per axis, after the paper's Fig. 7. U2 repeats it."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.param import Param, param

# Arguments of the seven sines, rate t + sweep t^2 (rad/s, rad/s^2): one vector, which costs little more than one sine.
_RATES = np.array([1.0, 2.0, 20.0, 0.5, np.pi / 2, 3.0, 0.0])
_SWEEPS = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25])


class SuiteU1(AbstractDisturbance):
    """Six lumped accelerations: steps on a swell, high frequency, square wave, pulse, ramp and reset, chirp."""

    scale: Float[Param, ""] = param("", "factor on all six", default=1.0)
    period: float = eqx.field(static=True, default=math.inf)  # s, after which it repeats

    def realize(self, key) -> tuple[()]:
        return ()

    def at(self, realization, t, pose, load: Load) -> Load:
        if load.acceleration.shape != (6,):
            raise BadInput("disturbance", "fit the plant", "u1, which has 6 axes", hint="Use kind: table")
        if self.period < math.inf:
            t = t - self.period * jnp.floor(t / self.period)
        swell, fast, ripple, slow, square, pulse, chirp = jnp.sin(as_array(_RATES) * t + as_array(_SWEEPS) * t**2)
        signals = jnp.stack(
            [
                4 * swell + _step(t, 8.0, 6.0) - _step(t, 14.0, 9.0),
                3 * fast + 2 * ripple,
                -3 + 2 * slow + jnp.where(square >= 0, 3.0, -3.0),
                2 * pulse + _step(t, 6.0, 4.0) - _step(t, 10.0, 4.0),
                4 * (t / 10 - jnp.floor(t / 10)),
                2 * chirp,
            ]
        )
        return load._replace(acceleration=load.acceleration + self.scale * signals)

    def jumps(self, duration: float) -> tuple[float, ...]:
        once = min(duration, self.period)
        square = {2.0 * k for k in range(1, int(once // 2) + 1)}
        resets = {10.0 * k for k in range(1, int(once // 10) + 1)}
        jumps = {t for t in {6.0, 8.0, 10.0, 14.0} | square | resets if t <= once}
        turns = range(math.ceil(duration / once)) if duration > 0 else ()
        return tuple(sorted({t + k * once for t in jumps for k in turns if t + k * once < duration}))


def _step(t: Float[Array, ""], at: float, size: float) -> Float[Array, ""]:
    return jnp.where(t >= at, size, 0.0)


def u1(scale: float = 1.0) -> SuiteU1:
    """Benchmark suite U1 of six lumped accelerations (m/s^2, rad/s^2).

    Args:
        scale: factor on all of them.
    """
    return SuiteU1(scale)
