"""The benchmark's metrics, defined once: gathered tick by tick inside the loop, or from a recorded series."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.param import param
from undertow.loop.closed_loop import Sample
from undertow.loop.outcome import Outcome
from undertow.loop.sampled import AbstractAccumulator

PerAxis = Float[Array, " n"]
Scalar = Float[Array, ""]

# Sample times are k * dt in floating point: a window takes its borders in.
_HAIR = 1e-9  # s

# Share of its step that the position error must leave no more to be settled.
_SETTLED = 0.02


class MetricsState(NamedTuple):
    """Running sums over a window."""

    samples: Scalar  # number of them inside the window
    squares: dict[str, PerAxis]  # of the signals of _SIGNALS
    largest_error: PerAxis
    voltage_squares: Scalar
    voltage_peak: Scalar
    variation: Scalar  # sum over samples of the mean |V_k - V_{k-1}|
    span: Scalar  # s covered by steps inside the window
    energy: Scalar
    saturated: Scalar
    weights_peak: Scalar
    bad_readings: Scalar
    step: PerAxis  # |error| at the first sample of the run
    settled_at: PerAxis
    previous: Any  # (t, voltage, power, inside) of the sample before


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

    def init(self, sample: Sample) -> MetricsState:
        axes, zero = jnp.zeros_like(sample.error), jnp.zeros(())
        return MetricsState(
            samples=zero,
            squares=dict.fromkeys(_SIGNALS, axes),
            largest_error=axes,
            voltage_squares=zero,
            voltage_peak=zero,
            variation=zero,
            span=zero,
            energy=zero,
            saturated=zero,
            weights_peak=zero,
            bad_readings=zero,
            step=-jnp.ones_like(axes),
            settled_at=axes,
            previous=(zero, jnp.zeros_like(sample.voltage), zero, zero),
        )

    def update(self, state: MetricsState, t: Scalar, sample: Sample) -> MetricsState:
        inside = jnp.where((t >= self.start - _HAIR) & (t <= self.stop + _HAIR), 1.0, 0.0)
        last_t, last_voltage, last_power, last_inside = state.previous
        power, between = sample.power.sum(), inside * last_inside
        size = jnp.abs(sample.error)
        step = jnp.where(state.step < 0, size, state.step)
        return MetricsState(
            samples=state.samples + inside,
            squares={name: state.squares[name] + inside * pick(sample) ** 2 for name, pick in _SIGNALS.items()},
            largest_error=jnp.maximum(state.largest_error, inside * size),
            voltage_squares=state.voltage_squares + inside * (sample.voltage**2).mean(),
            voltage_peak=jnp.maximum(state.voltage_peak, inside * jnp.abs(sample.voltage).max()),
            variation=state.variation + between * jnp.abs(sample.voltage - last_voltage).mean(),
            span=state.span + between * (t - last_t),
            energy=state.energy + between * (t - last_t) * (power + last_power) / 2,
            saturated=state.saturated + inside * sample.saturated.mean(),
            weights_peak=jnp.maximum(state.weights_peak, inside * sample.weights_peak),
            bad_readings=jnp.maximum(state.bad_readings, inside * sample.bad_readings.astype(inside.dtype)),
            step=step,
            settled_at=jnp.where(size > _SETTLED * step, t, state.settled_at),
            previous=(t, sample.voltage, power, inside),
        )


def results(state: MetricsState) -> dict[str, Any]:
    """Metrics by their names in result files: overall values as numbers, per-axis values as `<name>_axes` lists."""
    host = jax.tree.map(np.asarray, state)
    count = max(float(host.samples), 1.0)
    found: dict[str, Any] = {name: float(value) for name, value in overall(host).items()}
    for name, squares in host.squares.items():
        found[f"{name}_rms_axes"] = np.sqrt(squares / count).tolist()
    return found | {
        "tracking_max_axes": host.largest_error.tolist(),
        "settling_time_axes": host.settled_at.tolist(),
    }


# Over all axes: name -> value of a state whose leaves may have leading axes, given its number of samples.
_OVERALL: dict[str, Callable[[MetricsState, Any], Any]] = {
    **{f"{name}_rms": lambda s, count, name=name: np.sqrt(s.squares[name].mean(-1) / count) for name in _SIGNALS},
    "tracking_max": lambda s, count: s.largest_error.max(-1),
    "voltage_rms": lambda s, count: np.sqrt(s.voltage_squares / count),
    "voltage_peak": lambda s, count: s.voltage_peak,
    "voltage_variation": lambda s, count: np.where(s.span > 0, s.variation / np.where(s.span > 0, s.span, 1.0), 0.0),
    "weights_peak": lambda s, count: s.weights_peak,
    "energy": lambda s, count: s.energy,
    "settling_time": lambda s, count: s.settled_at.max(-1),
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
    return results(_over_series(Metrics(start, stop), outcome.time, outcome.samples))


@eqx.filter_jit
def _over_series(metrics: Metrics, time: Array, samples: Sample) -> MetricsState:
    first = jax.tree.map(lambda series: series[0], samples)
    step = lambda state, at: (metrics.update(state, *at), None)
    return jax.lax.scan(step, metrics.init(first), (time, samples))[0]
