"""Signals of several laws, and those of the Lyapunov function."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.tracking_error import Tracking
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]
Scalar = Float[Array, ""]

# Sums run over the axes.
ESTIMATE = {"estimate": Signal(("axis",), "[axis]/s^2", "estimate d_hat of the lumped uncertainty")}
ROBUST_TERM = {"robust_term": Signal(("axis",), "[axis]/s^2", "robust term u_r")}
MODELLING_ERROR = {"modelling_error": Signal(("axis",), "[axis]/s", "modelling error eps = x_hat_dot - x_dot")}
WEIGHTS = {
    "weights": Signal(("axis", "rule"), "[axis]/s^2", "weights theta of the fuzzy rules"),
    "weights_peak": Signal((), "[axis]/s^2", "largest |theta|"),
    "weights_at_bound": Signal((), "1", "share of the weights at +-theta_max: projection active"),
    "weights_spread": Signal((), "[axis]/s^2", "largest difference between weights of one axis, a measure of drift"),
}
LYAPUNOV = {
    "lyapunov_tracking": Signal((), "[axis]^2/s^2", "tracking part of the Lyapunov function, 1/2 E^T P E"),
    "lyapunov_decay": Signal((), "[axis]^2/s^3", "decay of the Lyapunov function by feedback, 1/2 E^T Q E"),
}
ATTAINED_SHARE = {"attained_share": Signal((), "1", "share of the desired acceleration that the command can give")}
MEMORY = {
    "memory": Signal(("axis",), "[axis]/s^2", "share of the estimate that the memory and the learnt inertia give"),
    "memory_weights": Signal(("regressor", "axis"), "[axis]/s^2", "weights of the memory"),
    "memory_taken": Signal(("axis",), "[axis]/s^2", "what the memory has taken over from the observer so far"),
    "memory_trust": Signal(("axis",), "1", "share of what was learnt that is used: 1 unless it harms"),
    "memory_variance": Signal(
        ("regressor",), "1", "variance of a weight over that before learning: 1 where not excited"
    ),
}
INERTIA = {
    "inertia": Signal(("axis",), "1", "inertia over that of the nominal model, as identified by probing"),
    "inertia_error": Signal(("axis",), "1", "standard error of the identified inertia; large where nothing is known"),
}
ADAPTIVE_LAW = ESTIMATE | ROBUST_TERM | MODELLING_ERROR | WEIGHTS | LYAPUNOV | ATTAINED_SHARE


def lyapunov_signals(
    tracking_error: Tracking, lyapunov: Float[Array, "*#n 2 2"], weight: Float[Array, "*#n 2 2"]
) -> dict[str, Scalar]:
    """1/2 E^T P E of Eq. (46) and 1/2 E^T Q E of Eq. (58), with the law's own E, summed over axes."""
    return {"lyapunov_tracking": _half(tracking_error, lyapunov), "lyapunov_decay": _half(tracking_error, weight)}


def weight_signals(weights: Float[Array, "n rules"], bound: Float[Array, "..."]) -> dict[str, Array]:
    """Weights theta, their largest size, their share at +-bound (one number or one per axis) and their spread."""
    at_bound = jnp.abs(weights) >= jnp.broadcast_to(bound, weights.shape[:1])[:, None]
    return {
        "weights": weights,
        "weights_peak": jnp.abs(weights).max(initial=0.0),
        "weights_at_bound": at_bound.mean(dtype=float),
        "weights_spread": (weights.max(-1) - weights.min(-1)).max(),
    }


def share_given(desired: PerAxis, attained: PerAxis) -> Scalar:
    """Share of a desired acceleration that another one gives, along its direction, 0 to 1; 1 where none is desired."""
    size = (desired**2).sum()
    share = (desired * attained).sum() / jnp.where(size > 0, size, 1.0)
    return jnp.where(size > 0, jnp.clip(share, 0.0, 1.0), 1.0)


def _half(tracking_error: Tracking, matrix: Float[Array, "*#n 2 2"]) -> Scalar:
    diagonal = matrix[..., 0, 0] * tracking_error.error**2 + matrix[..., 1, 1] * tracking_error.rate**2
    return (diagonal / 2 + matrix[..., 0, 1] * tracking_error.error * tracking_error.rate).sum()
