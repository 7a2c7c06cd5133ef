"""What only a law can tell of its own Lyapunov function: scalars, looked at and never carried."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.controllers.tracking_error import Tracking

PerAxis = Float[Array, " n"]
Scalar = Float[Array, ""]

# Entry of a telemetry's `diagnostics` -> meaning and unit. Sums run over the axes.
COLUMNS = {
    "lyapunov_tracking": ("tracking part of the Lyapunov function, 1/2 E^T P E", "m^2/s^2, rad^2/s^2"),
    "lyapunov_decay": ("rate at which feedback takes from it, 1/2 E^T Q E", "m^2/s^3, rad^2/s^3"),
    "weights_at_bound": ("share of the weights at +-theta_max: projection active", "1"),
    "weights_spread": ("largest difference between weights of one axis: drift shows here", "m/s^2, rad/s^2"),
    "attained_share": ("share of the wanted acceleration that the command can give", "1"),
}


def tracking_diagnostics(
    off: Tracking, lyapunov: Float[Array, "*n 2 2"], weight: Float[Array, "*n 2 2"]
) -> dict[str, Scalar]:
    """1/2 E^T P E of Eq. (46) and 1/2 E^T Q E of Eq. (58), E as the law sees it, summed over axes."""
    return {"lyapunov_tracking": _half(off, lyapunov), "lyapunov_decay": _half(off, weight)}


def weight_diagnostics(weights: Float[Array, "n rules"], bound: Float[Array, "..."]) -> dict[str, Scalar]:
    """Share of the weights that stand at +-bound (one number or one per axis), and how far they have come apart."""
    at_bound = jnp.abs(weights) >= jnp.broadcast_to(bound, weights.shape[:1])[:, None]
    return {
        "weights_at_bound": at_bound.mean(dtype=float),
        "weights_spread": (weights.max(-1) - weights.min(-1)).max(),
    }


def share_given(wanted: PerAxis, given: PerAxis) -> Scalar:
    """Share of a wanted acceleration that another one gives, along its direction, 0 to 1; 1 where nothing is wanted."""
    size = (wanted**2).sum()
    share = (wanted * given).sum() / jnp.where(size > 0, size, 1.0)
    return jnp.where(size > 0, jnp.clip(share, 0.0, 1.0), 1.0)


def _half(off: Tracking, matrix: Float[Array, "*n 2 2"]) -> Scalar:
    diagonal = matrix[..., 0, 0] * off.error**2 + matrix[..., 1, 1] * off.rate**2
    return (diagonal / 2 + matrix[..., 0, 1] * off.error * off.rate).sum()
