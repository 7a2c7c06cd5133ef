"""Cubic spline through given points that starts and ends at rest.

Source: de Boor (2001), "A Practical Guide to Splines", rev. ed., ch. IV, complete cubic spline interpolation: the
slopes at the points solve a tridiagonal system; between two points the curve is the cubic Hermite polynomial.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def clamped_slopes(knots: Float[np.ndarray, " k"], values: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k n"]:
    """Slopes at the knots, zero at both ends, that make the second derivative continuous; computed with NumPy.

    Args:
        knots: increasing.
        values: one row per knot.
    """
    steps = np.diff(knots)
    chords = np.diff(values, axis=0) / steps[:, None]
    slopes, share = np.zeros_like(values), np.zeros_like(knots)
    # steps[i] s[i-1] + 2 (steps[i-1] + steps[i]) s[i] + steps[i-1] s[i+1] = right side, by elimination (Thomas).
    for i in range(1, len(knots) - 1):
        before, after = steps[i - 1], steps[i]
        pivot = 2 * (before + after) - after * share[i - 1]
        share[i] = before / pivot
        slopes[i] = (3 * (after * chords[i - 1] + before * chords[i]) - after * slopes[i - 1]) / pivot
    for i in range(len(knots) - 2, 0, -1):
        slopes[i] -= share[i] * slopes[i + 1]
    return slopes


def spline(
    t: Float[Array, ""], knots: Float[Array, " k"], values: Float[Array, "k n"], slopes: Float[Array, "k n"]
) -> tuple[Float[Array, " n"], Float[Array, " n"], Float[Array, " n"]]:
    """Value, first and second derivative at t; constant before the first knot and after the last.

    Args:
        t: argument.
        knots: increasing.
        values: one row per knot.
        slopes: first derivatives, one row per knot.
    """
    i = jnp.clip(jnp.searchsorted(knots, t, side="right") - 1, 0, knots.shape[0] - 2)
    step = knots[i + 1] - knots[i]
    x = jnp.clip(t, knots[0], knots[-1]) - knots[i]
    chord = (values[i + 1] - values[i]) / step
    square = (3.0 * chord - 2.0 * slopes[i] - slopes[i + 1]) / step
    cube = (slopes[i] + slopes[i + 1] - 2.0 * chord) / step**2
    inside = (knots[0] <= t) & (t <= knots[-1])
    return (
        values[i] + x * (slopes[i] + x * (square + x * cube)),
        jnp.where(inside, slopes[i] + x * (2.0 * square + x * 3.0 * cube), 0.0),
        jnp.where(inside, 2.0 * square + x * 6.0 * cube, 0.0),
    )
