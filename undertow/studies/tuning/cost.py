"""Cost of a run: smooth, dimensionless and finite."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.param import Param, param
from undertow.scenario.schema import Weights
from undertow.simulation.loop.recorded_signals import Signals
from undertow.simulation.loop.sampled import AbstractAccumulator

Scalar = Float[Array, ""]

_HAIR = 1e-9  # s; times are k dt in floating point
_SMOOTH = 1e-6  # |x| is rounded below this
_MOST = 100.0  # upper bound of each part, so that a failed run does not outweigh all others


class Sums(NamedTuple):
    """Running sums over the window."""

    samples: Scalar
    tracking: Scalar
    position: Scalar
    attitude: Scalar
    effort: Scalar
    variation: Scalar
    span: Scalar  # s
    last: tuple[Scalar, Float[Array, " m"], Scalar]  # t, share of the input, whether inside


class Shares(NamedTuple):
    """Dimensionless parts of the cost, and the errors behind it."""

    tracking: Scalar  # rms tracking error, each axis relative to its scale
    effort: Scalar  # rms input, as a share of its limit
    variation: Scalar  # total variation of the input per second, as a share of its limit: chattering and noise
    lost: Scalar  # share of the duration that a failed run lacks
    position: Scalar  # rms error per axis, m (or the unit of the plant); not a part of the cost
    attitude: Scalar  # rms error per axis, rad; likewise

    def cost(self, weights: Weights) -> Scalar:
        """The weighted sum."""
        return (
            weights.tracking * self.tracking
            + weights.effort * self.effort
            + weights.variation * self.variation
            + weights.failure * self.lost
        )


class CostSums(AbstractAccumulator):
    """Accumulates what `Shares` needs, step by step from `start` on."""

    is_angle: tuple[bool, ...] = eqx.field(static=True)  # of the axes
    start: Float[Param, ""] = param("s", "start of the evaluated window")
    error_scale: Float[Param, " n"] = param("m, rad", "errors with a cost of one; infinite for axes that do not count")
    input_scale: Float[Param, ""] = param("unit of the input", "input with a cost of one")

    def init(self, signals: Signals) -> Sums:
        zero = jnp.zeros(())
        return Sums(zero, zero, zero, zero, zero, zero, zero, (zero, jnp.zeros_like(signals["input"]), zero))

    def update(self, state: Sums, t: Scalar, signals: Signals) -> Sums:
        inside = jnp.where(t >= self.start - _HAIR, 1.0, 0.0)
        last_t, last_share, last_inside = state.last
        share = signals["input"] / self.input_scale
        between = inside * last_inside
        step = jnp.sqrt((share - last_share) ** 2 + _SMOOTH**2) - _SMOOTH
        squares = inside * signals["error"] ** 2
        return Sums(
            samples=state.samples + inside,
            tracking=state.tracking + inside * _bounded(((signals["error"] / self.error_scale) ** 2).mean(), _MOST**2),
            position=state.position + _bounded(_mean_of(squares, [not angle for angle in self.is_angle]), _MOST**2),
            attitude=state.attitude + _bounded(_mean_of(squares, self.is_angle), _MOST**2),
            effort=state.effort + inside * _bounded((share**2).mean(), _MOST**2),
            variation=state.variation + between * step.mean(),
            span=state.span + between * (t - last_t),
            last=(t, share, inside),
        )


def shares(sums: Sums, ended: Scalar, duration: float) -> Shares:
    """Parts of the cost of a run.

    Args:
        sums: sums over the window.
        ended: time of failure, or the duration, s.
        duration: s.
    """
    rms = lambda squares: jnp.sqrt(squares / jnp.maximum(sums.samples, 1.0) + _SMOOTH**2)
    variation = sums.variation / jnp.maximum(sums.span, _SMOOTH)
    parts = Shares(
        tracking=rms(sums.tracking),
        effort=rms(sums.effort),
        variation=_bounded(variation, _MOST),
        lost=1 - ended / duration,
        position=rms(sums.position),
        attitude=rms(sums.attitude),
    )
    return Shares(*(jnp.nan_to_num(part, nan=_MOST, posinf=_MOST) for part in parts))


_ALIKE = 0.005  # difference of two costs, as a share, that three digits do not show


def times_other(cost: float, other: float) -> str:
    """A cost as a multiple of another one, in words that say which is smaller."""
    if abs(cost - other) < _ALIKE * other:
        return "as large as"
    return f"{other / cost:.3g} times smaller than" if cost < other else f"{cost / other:.3g} times larger than"


def _mean_of(values: Float[Array, " n"], counts: Sequence[bool]) -> Scalar:
    """Mean of the entries that count; zero where none does."""
    chosen = [value for value, is_chosen in zip(values, counts, strict=True) if is_chosen]
    return sum(chosen, jnp.zeros(())) / max(1, len(chosen))


def _bounded(x, most: float):
    """Approximately x while it is small, and below `most`."""
    return x / (1 + x / most)
