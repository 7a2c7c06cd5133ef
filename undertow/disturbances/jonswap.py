"""The JONSWAP spectrum by shares of its energy."""

import jax.numpy as jnp
from jaxtyping import Array, Float

# Frequencies in units of the peak, wide enough for all but 1e-4 of the energy.
_LOWEST, _HIGHEST, _POINTS = 0.4, 8.0, 4000


def spectrum(frequency: Float[Array, "..."], period: Float[Array, ""], peakedness: Float[Array, ""]):
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
    """Frequencies (rad/s) below which these shares of the energy lie."""
    grid = jnp.linspace(_LOWEST, _HIGHEST, _POINTS) * 2 * jnp.pi / period
    density = spectrum(grid, period, peakedness)
    below = jnp.concatenate([jnp.zeros(1), jnp.cumsum((density[1:] + density[:-1]) / 2)])
    return jnp.interp(share, below / below[-1], grid)
