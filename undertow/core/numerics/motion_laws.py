"""Motion laws: distance along a path as a function of time, and exact derivatives of a motion.

Source: Biagiotti and Melchiorri (2008), "Trajectory Planning for Automatic Machines and Robots", ch. 2 and 3.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.number import Number

Curve = Callable[[Array], Array]


def quintic(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """From 0 at x = 0 to 1 at x = 1, constant outside; zero velocity and acceleration at both ends, so C2."""
    x = jnp.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def rounded_ramp(
    t: Float[Array, "..."] | float, height: Number, slope: Number, rounding: Number
) -> Float[Array, "..."]:
    """0 before t = 0, `height` after t = height / slope + rounding; both corners of the ramp rounded, C2 everywhere.

    The corner is the quintic between rest and motion (its highest coefficient vanishes). Where the ramp is
    shorter than its corners the slope stays below `slope`.

    Args:
        t: time, or another argument of the ramp.
        height: final value.
        slope: slope in the middle.
        rounding: length of a corner, in the unit of t.
    """
    apart = height / slope  # between the corners

    def one_corner(t):
        x = jnp.clip(t / rounding, 0.0, 1.0)
        return rounding * x**3 * (1.0 - 0.5 * x) + jnp.maximum(t - rounding, 0.0)

    t = jnp.clip(t, 0.0, apart + rounding)
    return slope * (one_corner(t) - one_corner(t - apart))


def with_rates(curve: Curve, t: Number) -> tuple[Array, Array, Array]:
    """Value, first and second derivative of a curve at t, exact: forward-mode differentiation, twice."""
    t = jnp.asarray(t, dtype=float)
    ones = jnp.ones_like(t)
    (value, rate), (_, second) = jax.jvp(lambda t: jax.jvp(curve, (t,), (ones,)), (t,), (ones,))
    return value, rate, second
