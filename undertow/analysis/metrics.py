"""The benchmark's metrics, defined once: gathered step by step inside the loop, or from a recorded series."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.param import param
from undertow.loop.closed_loop import Signals
from undertow.loop.outcome import Outcome
from undertow.loop.sampled import AbstractAccumulator

PerAxis = Float[Array, " n"]
Scalar = Float[Array, ""]

# Sampling times are k * dt in floating point: a window takes its borders in.
_HAIR = 1e-9  # s

# Share of the way to the last target that the error must leave no more to be settled.
_SETTLED = 0.02
_NO_WAY = 1e-9  # m, rad; an axis that has no further to go has nothing to settle


class MetricsState(NamedTuple):
    """Running sums over a window."""

    samples: Scalar  # number of them inside the window
    squares: dict[str, PerAxis]  # of the signals of _SIGNALS
    largest_error: PerAxis
    input_squares: Scalar
    input_peak: Scalar
    variation: Scalar  # sum over samples of the mean |u_k - u_{k-1}|
    span: Scalar  # s covered by steps inside the window
    energy: Scalar
    saturated: Scalar
    weights_peak: Scalar
    bad_readings: Scalar
    settling: "Settling"
    previous: Any  # (t, input, power, inside) of the sample before


class Settling(NamedTuple):
    """Since when the target has stayed where it is, and the error small."""

    begun: Scalar  # 1 from the first sample on
    start: PerAxis  # way to a target at zero, from where the run began
    target: PerAxis  # of the sample before
    since: PerAxis  # time after which neither moved on; the last time it did
    last: Scalar  # time of the last sample, s
    resting: Scalar  # 1 while the target stays

    def updated(self, t: Scalar, sample: Signals, counts: Any) -> "Settling":
        """With a sample more, where it counts."""
        first = self.begun == 0
        start = jnp.where(first, sample.error - sample.target, self.start)
        rests = first | (sample.target == self.target).all()
        outside = jnp.abs(sample.error) > _SETTLED * jnp.abs(start + sample.target)
        since = jnp.where(rests & ~outside, self.since, t)
        resting = jnp.where(rests, 1.0, 0.0)
        new = Settling(jnp.ones_like(self.begun), start, sample.target, since, t, resting)
        return Settling(*(jnp.where(counts, now, before) for now, before in zip(new, self, strict=True)))

    def times(self) -> np.ndarray:
        """Settling time of each axis, s; infinite where it is not settled, NaN where there is nothing to settle.

        Of results on the host, whose leaves may have leading axes.
        """
        last, resting = self.last[..., None], self.resting[..., None]
        found = np.where(self.since < last, self.since, np.inf)
        return np.where((np.abs(self.start + self.target) > _NO_WAY) & (resting > 0), found, np.nan)


# Metric name -> the signal whose rms it is.
_SIGNALS = {
    "tracking": lambda s: s.error,
    "estimation": lambda s: s.estimate - s.uncertainty,
    "uncertainty": lambda s: s.uncertainty,
    "robust": lambda s: s.robust,
    "model": lambda s: s.modelling_error,
}


class Metrics(AbstractAccumulator):
    """All metrics over start <= t <= stop."""

    start: Scalar = param("s", "first time that counts", default=0.0)
    stop: Scalar = param("s", "last time that counts", default=jnp.inf)

    def init(self, sample: Signals) -> MetricsState:
        axes, zero = jnp.zeros_like(sample.error), jnp.zeros(())
        return MetricsState(
            samples=zero,
            squares=dict.fromkeys(_SIGNALS, axes),
            largest_error=axes,
            input_squares=zero,
            input_peak=zero,
            variation=zero,
            span=zero,
            energy=zero,
            saturated=zero,
            weights_peak=zero,
            bad_readings=zero,
            settling=Settling(zero, axes, axes, axes, zero, zero),
            previous=(zero, jnp.zeros_like(sample.voltage), zero, zero),
        )

    def update(self, state: MetricsState, t: Scalar, sample: Signals) -> MetricsState:
        inside = jnp.where((t >= self.start - _HAIR) & (t <= self.stop + _HAIR), 1.0, 0.0)
        last_t, last_input, last_power, last_inside = state.previous
        power, between = sample.power.sum(), inside * last_inside
        size, applied = jnp.abs(sample.error), sample.voltage
        return MetricsState(
            samples=state.samples + inside,
            squares={name: state.squares[name] + inside * pick(sample) ** 2 for name, pick in _SIGNALS.items()},
            largest_error=jnp.maximum(state.largest_error, inside * size),
            input_squares=state.input_squares + inside * (applied**2).mean(),
            input_peak=jnp.maximum(state.input_peak, inside * jnp.abs(applied).max()),
            variation=state.variation + between * jnp.abs(applied - last_input).mean(),
            span=state.span + between * (t - last_t),
            energy=state.energy + between * (t - last_t) * (power + last_power) / 2,
            saturated=state.saturated + inside * sample.saturated.mean(),
            weights_peak=jnp.maximum(state.weights_peak, inside * sample.weights_peak),
            bad_readings=jnp.maximum(state.bad_readings, inside * sample.bad_readings.astype(inside.dtype)),
            settling=state.settling.updated(t, sample, t <= self.stop + _HAIR),
            previous=(t, applied, power, inside),
        )


def results(state: MetricsState) -> dict[str, Any]:
    """Metrics by their names in result files: overall values as numbers, per-axis values as `<name>_axes` lists."""
    host = jax.tree.map(np.asarray, state)
    count = max(float(host.samples), 1.0)
    found: dict[str, Any] = {name: float(value) for name, value in overall(host).items()}
    for name, squares in host.squares.items():
        found[f"{name}_rms_axes"] = np.sqrt(squares / count).tolist()
    found["tracking_max_axes"] = host.largest_error.tolist()
    if np.isnan(found["settling_time"]):  # what is not defined is not there
        del found["settling_time"]
        return found
    return found | {"settling_time_axes": host.settling.times().tolist()}


# Over all axes: name -> value of a state whose leaves may have leading axes, given its number of samples.
_OVERALL: dict[str, Callable[[MetricsState, Any], Any]] = {
    **{f"{name}_rms": lambda s, count, name=name: np.sqrt(s.squares[name].mean(-1) / count) for name in _SIGNALS},
    "tracking_max": lambda s, count: s.largest_error.max(-1),
    "input_rms": lambda s, count: np.sqrt(s.input_squares / count),
    "input_peak": lambda s, count: s.input_peak,
    "input_variation": lambda s, count: np.where(s.span > 0, s.variation / np.where(s.span > 0, s.span, 1.0), 0.0),
    "weights_peak": lambda s, count: s.weights_peak,
    "energy": lambda s, count: s.energy,
    "settling_time": lambda s, count: np.fmax.reduce(s.settling.times(), axis=-1),
    "saturated_fraction": lambda s, count: s.saturated / count,
    "bad_readings": lambda s, count: s.bad_readings,
}
OVERALL = tuple(_OVERALL)


def overall(state: MetricsState) -> dict[str, np.ndarray]:
    """Metrics over all axes by their names; of many runs at once where the leaves have leading axes."""
    host = jax.tree.map(np.asarray, state)
    count = np.maximum(host.samples, 1.0)
    return {name: value(host, count) for name, value in _OVERALL.items()}


def measure(outcome: Outcome, start: float = 0.0, stop: float = float("inf")) -> dict[str, Any]:
    """Metrics of a recorded run over start <= t <= stop, s, at the rate of the record."""
    samples, kept = outcome.signals, int((np.asarray(outcome.time) <= stop + _HAIR).sum())
    if 0 < kept < len(outcome.time):  # what comes later may be no numbers, and none of them times zero is none
        index = np.minimum(np.arange(len(outcome.time)), kept - 1)
        samples = jax.tree.map(lambda series: np.asarray(series)[index], samples)
    return results(_over_series(Metrics(start, stop), outcome.time, samples))


@eqx.filter_jit
def _over_series(metrics: Metrics, time: Array, samples: Signals) -> MetricsState:
    first = jax.tree.map(lambda series: series[0], samples)
    step = lambda state, at: (metrics.update(state, *at), None)
    return jax.lax.scan(step, metrics.init(first), (time, samples))[0]
