"""Metrics of a run, computed step by step inside the loop or from a recorded series."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractPlant
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_program
from undertow.core.metric import AbstractMetric, Metric
from undertow.core.numerics.rotations import attitude_error, quaternion_from_euler
from undertow.core.param import Param, param
from undertow.core.signals import Signal
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.loop.recorded_signals import Signals
from undertow.simulation.loop.sampled import AbstractAccumulator

PerAxis = Float[Array, " n"]
Scalar = Float[Array, ""]

# Sampling times are k * dt in floating point: a window takes its borders in.
_HAIR = 1e-9  # s

# Share of the way to the last target that the error must leave no more to be settled, and the share of the time at the
# end during which it must have stayed: an error that crosses the band again and again is inside it at some last moment
# too, and the shorter that moment, the less it says about what follows. A tenth leaves most of a run for settling.
_SETTLED, _STAYS = 0.02, 0.1
_NO_WAY = 1e-9  # m, rad; an axis that has no further to go has nothing to settle


class MetricsState(NamedTuple):
    """Running sums over a window."""

    samples: Scalar  # number of them inside the window
    squares: dict[str, PerAxis]  # of the signals of _RMS that are recorded
    largest_error: PerAxis
    turn_squares: Scalar | None  # of the angle between attitude and target; None where there is no attitude
    input_squares: Scalar
    input_peak: Scalar
    variation: Scalar  # sum over samples of the mean |u_k - u_{k-1}|
    span: Scalar  # s covered by steps inside the window
    energy: Scalar
    saturated: Scalar
    weights_peak: PerAxis | None  # None for a law without weights
    bad_readings: Scalar
    nees: Scalar | None  # sum over samples; None without a filter that says how large its errors are
    settling: "Settling"
    previous: Any  # (t, input, supply, inside) of the sample before


class Settling(NamedTuple):
    """Since when the target has stayed where it is, and the error small."""

    begun: Scalar  # 1 from the first sample on
    start: PerAxis  # way to a target at zero, from where the run began
    target: PerAxis  # of the sample before
    since: PerAxis  # time after which neither moved on; the last time it did
    last: Scalar  # time of the last sample, s
    resting: Scalar  # 1 while the target stays

    def updated(self, t: Scalar, signals: Signals, counts: Any) -> "Settling":
        """With a sample more, where it counts."""
        first = self.begun == 0
        start = jnp.where(first, signals["error"] - signals["reference"], self.start)
        rests = first | (signals["reference"] == self.target).all()
        outside = jnp.abs(signals["error"]) > _SETTLED * jnp.abs(start + signals["reference"])
        since = jnp.where(rests & ~outside, self.since, t)
        resting = jnp.where(rests, 1.0, 0.0)
        new = Settling(jnp.ones_like(self.begun), start, signals["reference"], since, t, resting)
        return Settling(*(jnp.where(counts, now, before) for now, before in zip(new, self, strict=True)))

    def times(self) -> np.ndarray:
        """Settling time of each axis, s; infinite where it is not settled, NaN where there is nothing to settle.

        Of results on the host, whose leaves may have leading axes.
        """
        last, resting = self.last[..., None], self.resting[..., None]
        settling_times = np.where(self.since < (1 - _STAYS) * last, self.since, np.inf)
        return np.where((np.abs(self.start + self.target) > _NO_WAY) & (resting > 0), settling_times, np.nan)


# Metric -> the signals that it needs, and what it is the rms of. A law that lacks one has no such metric.
_RMS: dict[str, tuple[tuple[str, ...], Callable[[Signals], PerAxis]]] = {
    "error": (("error",), lambda s: s["error"]),
    "estimation": (("estimate",), lambda s: s["estimate"] - s["uncertainty"]),
    "uncertainty": (("uncertainty",), lambda s: s["uncertainty"]),
    "robust": (("robust_term",), lambda s: s["robust_term"]),
    "model": (("modelling_error",), lambda s: s["modelling_error"]),
}

# Outputs that are the Euler angles of a body, in this order.
_EULER = ("roll", "pitch", "yaw")

# Outputs whose unit is the key make one figure; those of any other unit do only where all outputs have it.
_GROUPS = {"m": "position", "rad": "attitude"}
_ALL = "tracking"


def output_groups(units: Sequence[str]) -> dict[str, tuple[str, list[int]]]:
    """Outputs that share a unit: name -> unit and places. Metres and radians never make one number."""
    groups = {}
    for unit, name in _GROUPS.items():
        if unit in units:
            groups[name] = (unit, [i for i, output_unit in enumerate(units) if output_unit == unit])
    one_kind = not groups and len(set(units)) == 1
    return {_ALL: (units[0], list(range(len(units))))} if one_kind else groups


def euler_places(outputs: Sequence[str]) -> tuple[int, ...]:
    """Places of roll, pitch and yaw among the names of outputs; none unless all three are there."""
    return tuple(map(list(outputs).index, _EULER)) if set(_EULER) <= set(outputs) else ()


def of_group(group: str, name: str) -> str:
    """Name of a metric of the outputs of one group: `position_rms` of the error, else `position_estimation_rms`."""
    if name.startswith("error_"):
        return f"{group}_{name.removeprefix('error_')}"
    return name if group == _ALL else f"{group}_{name}"


class Metrics(AbstractAccumulator):
    """The metrics of every run, over start <= t <= stop.

    Args:
        start, stop: the window, s.
        units: of the outputs.
        euler: places of roll, pitch and yaw among the outputs; empty where a plant has none.
    """

    start: Float[Param, ""] = param("s", "first time that counts", default=0.0)
    stop: Float[Param, ""] = param("s", "last time that counts", default=jnp.inf)
    units: tuple[str, ...] = eqx.field(static=True, default=("m",))
    euler: tuple[int, ...] = eqx.field(static=True, default=())

    def init(self, signals: Signals) -> MetricsState:
        axes, zero = jnp.zeros_like(signals["error"]), jnp.zeros(())
        return MetricsState(
            samples=zero,
            squares={name: axes for name, (needed, _) in _RMS.items() if all(signal in signals for signal in needed)},
            largest_error=axes,
            turn_squares=zero if self.euler else None,
            input_squares=zero,
            input_peak=zero,
            variation=zero,
            span=zero,
            energy=zero,
            saturated=zero,
            weights_peak=axes if "weights" in signals else None,
            bad_readings=zero,
            nees=zero if "nees" in signals else None,
            settling=Settling(zero, axes, axes, axes, zero, zero),
            previous=(zero, jnp.zeros_like(signals["input"]), zero, zero),
        )

    def update(self, state: MetricsState, t: Scalar, signals: Signals) -> MetricsState:
        inside = jnp.where((t >= self.start - _HAIR) & (t <= self.stop + _HAIR), 1.0, 0.0)
        last_t, last_input, last_supply, last_inside = state.previous
        between = inside * last_inside
        supply, energy = _supplied(signals, last_supply, t - last_t)
        size, applied = jnp.abs(signals["error"]), signals["input"]
        weights_peak = state.weights_peak
        if weights_peak is not None:
            weights_peak = jnp.maximum(weights_peak, inside * jnp.abs(signals["weights"]).max(-1, initial=0.0))
        turn_squares = state.turn_squares
        if turn_squares is not None:
            turn_squares = turn_squares + inside * self._turn(signals) ** 2
        return MetricsState(
            samples=state.samples + inside,
            squares={name: sums + inside * _RMS[name][1](signals) ** 2 for name, sums in state.squares.items()},
            largest_error=jnp.maximum(state.largest_error, inside * size),
            turn_squares=turn_squares,
            input_squares=state.input_squares + inside * (applied**2).mean(),
            input_peak=jnp.maximum(state.input_peak, inside * jnp.abs(applied).max()),
            variation=state.variation + between * jnp.abs(applied - last_input).mean(),
            span=state.span + between * (t - last_t),
            energy=state.energy + between * energy,
            saturated=state.saturated + inside * signals["saturated"].mean(),
            weights_peak=weights_peak,
            bad_readings=jnp.maximum(state.bad_readings, inside * signals["bad_readings"].astype(inside.dtype)),
            nees=None if state.nees is None else state.nees + inside * signals["nees"],
            settling=state.settling.updated(t, signals, t <= self.stop + _HAIR),
            previous=(t, applied, supply, inside),
        )

    def _turn(self, signals: Signals) -> Scalar:
        """Angle of the rotation between the attitude and its target, rad, at most half a turn."""
        target, actual = (quaternion_from_euler(signals[name][self.euler,]) for name in ("reference", "position"))
        half = attitude_error(target, actual) / 2
        return 2 * jnp.arcsin(jnp.minimum(jnp.sqrt((half * half).sum()), 1.0))

    def values(self, state: MetricsState) -> dict[str, np.ndarray]:
        """Metrics by name, of many runs at once where the leaves have leading axes; NaN where one is not defined."""
        state = jax.tree.map(np.asarray, state)
        count = np.where(state.samples > 0, state.samples, np.nan)
        metrics = {}
        for group, (_, axes) in output_groups(self.units).items():
            for name, sums in state.squares.items():
                metrics[of_group(group, f"{name}_rms")] = np.sqrt(sums[..., axes].mean(-1) / count)
            metrics[of_group(group, "error_max")] = state.largest_error[..., axes].max(-1)
            if state.weights_peak is not None:
                metrics[of_group(group, "weights_peak")] = state.weights_peak[..., axes].max(-1)
        if state.turn_squares is not None:
            metrics[_TURN] = np.sqrt(state.turn_squares / count)
        metrics |= {
            "input_rms": np.sqrt(state.input_squares / count),
            "input_peak": state.input_peak,
            "input_variation": state.variation / np.where(state.span > 0, state.span, np.nan),
            "energy": state.energy,
            "settling_time": np.fmax.reduce(state.settling.times(), axis=-1),
            "saturated_fraction": state.saturated / count,
            "bad_readings": state.bad_readings,
        }
        if state.nees is not None:
            metrics["nees"] = state.nees / count
        return {name: np.where(np.isnan(count), np.nan, value) for name, value in metrics.items()}

    def per_axis(self, state: MetricsState) -> dict[str, list[float]]:
        """Metrics of each output, in its own unit, of one run."""
        state = jax.tree.map(np.asarray, state)
        if not state.samples:
            return {}
        metrics = {f"{name}_rms_axes": np.sqrt(sums / state.samples).tolist() for name, sums in state.squares.items()}
        metrics["error_max_axes"] = state.largest_error.tolist()
        if state.weights_peak is not None:
            metrics["weights_peak_axes"] = state.weights_peak.tolist()
        settled = state.settling.times()
        return metrics if np.isnan(settled).all() else metrics | {"settling_time_axes": settled.tolist()}


def _supplied(signals: Signals, before: Scalar, span: Scalar) -> tuple[Scalar, Scalar]:
    """What the energy supplied since the sample before, J, follows from, and that energy.

    The ledger is integrated with the plant. Without one only the power at the samples is known, right after a step of
    the input, and not how it goes on until the next.
    """
    if "energy_source" in signals:
        return signals["energy_source"], signals["energy_source"] - before
    power = signals["power"].sum()
    return power, span * (power + before) / 2


class Windowed(AbstractAccumulator):
    """A metric of somebody's own over start <= t <= stop, s."""

    metric: AbstractMetric
    start: Float[Param, ""] = param("s", "first time that counts", default=0.0)
    stop: Float[Param, ""] = param("s", "last time that counts", default=jnp.inf)

    def init(self, signals: Signals) -> Any:
        return self.metric.init(signals)

    def update(self, state: Any, t: Scalar, signals: Signals) -> Any:
        inside = (t >= self.start - _HAIR) & (t <= self.stop + _HAIR)
        return jax.tree.map(lambda now, was: jnp.where(inside, now, was), self.metric.update(state, t, signals), state)


Gathered = tuple[AbstractAccumulator, ...]


def accumulators(plant: AbstractPlant, user_metrics: Sequence[AbstractMetric], start: float, stop: float) -> Gathered:
    """What gathers all metrics of a run of a plant between two times, s; `user_metrics` are the scenario's own."""
    return (
        Metrics(start, stop, plant.output_units, euler_places(plant.outputs)),
        *(Windowed(metric, start, stop) for metric in user_metrics),
    )


def results(gathered: Gathered, states: Sequence[Any]) -> dict[str, Any]:
    """Metrics of one run by their names in result files; those that are not defined are not there.

    Figures as numbers; those of each output, in its own unit, as lists named `<name>_axes`.
    """
    metrics: dict[str, Any] = {}
    for accumulator, state in zip(gathered, states, strict=True):
        host = jax.tree.map(np.asarray, state)
        if isinstance(accumulator, Metrics):
            metrics |= accumulator.values(host) | accumulator.per_axis(host)
        elif isinstance(accumulator, Windowed):
            metrics |= accumulator.metric.values(host)
    plain = {name: value if isinstance(value, list) else float(value) for name, value in metrics.items()}
    return {name: value for name, value in plain.items() if isinstance(value, list) or not math.isnan(value)}


def results_of_batch(gathered: Gathered, states: Sequence[Any]) -> dict[str, np.ndarray]:
    """Metrics of many runs, whose states have one leading axis; NaN where one is not defined."""
    metrics: dict[str, np.ndarray] = {}
    for accumulator, state in zip(gathered, states, strict=True):
        if isinstance(accumulator, Metrics):
            metrics |= accumulator.values(state)
        elif isinstance(accumulator, Windowed):
            host = jax.tree.map(np.asarray, state)
            count = len(jax.tree.leaves(host)[0])
            metrics_of_runs = [
                accumulator.metric.values(jax.tree.map(lambda leaf, i=i: leaf[i], host)) for i in range(count)
            ]
            for name in accumulator.metric.metrics():
                metrics[name] = np.array([float(run[name]) for run in metrics_of_runs])
    return metrics


def measure(
    outcome: Outcome,
    plant: AbstractPlant,
    start: float = 0.0,
    stop: float = math.inf,
    user_metrics: Sequence[AbstractMetric] = (),
) -> dict[str, Any]:
    """Metrics of a recorded run over start <= t <= stop, s, at the rate of the record."""
    signals = outcome.signals
    count = int((np.asarray(outcome.time) <= stop + _HAIR).sum())
    if 0 < count < len(outcome.time):  # what comes later may be no numbers, and none of them times zero is none
        index = np.minimum(np.arange(len(outcome.time)), count - 1)
        signals = jax.tree.map(lambda series: np.asarray(series)[index], signals)
    gathered = accumulators(plant, user_metrics, start, stop)
    return results(gathered, _over_series(gathered, outcome.time, signals))


@kept_program
def _over_series(gathered: Gathered, time: Array, signals: Signals) -> tuple[Any, ...]:
    first = jax.tree.map(lambda series: series[0], signals)
    step = lambda states, at: (
        tuple(accumulator.update(s, *at) for accumulator, s in zip(gathered, states, strict=True)),
        None,
    )
    return jax.lax.scan(step, tuple(accumulator.init(first) for accumulator in gathered), (time, signals))[0]


# Metrics of the outputs: each comes for those in m, for those in rad (the short way round), or for all where they
# share another unit. An rms per axis is the root of the mean square over the samples and over these axes.
_OF_OUTPUTS = {
    "error_rms": Metric("[axis]", "rms per axis of the tracking error x_d - x", "{} error, rms per axis"),
    "error_max": Metric("[axis]", "largest tracking error of any axis", "{} error, largest"),
    "estimation_rms": Metric("[axis]/s^2", "rms per axis of d_hat - d", "load estimate error, {}, rms"),
    "uncertainty_rms": Metric(
        "[axis]/s^2", "rms per axis of the uncertainty d = x_ddot - F - G u", "load and model error, {}, rms"
    ),
    "robust_rms": Metric("[axis]/s^2", "rms per axis of the robust term u_r", "robust term, {}, rms"),
    "model_rms": Metric(
        "[axis]/s", "rms per axis of the modelling error x_hat_dot - x_dot", "modelling error, {}, rms"
    ),
    "weights_peak": Metric("[axis]/s^2", "largest |theta|, which shows parameter drift", "fuzzy weights, {}, largest"),
}
_TURN = "orientation_rms"
_WHICH = {"position": "outputs in m", "attitude": "outputs in rad", _ALL: "outputs that share another unit"}

# In the order of tables. `Metrics` has those up to `nees`; the others are known once a run is over.
MEANINGS = {
    of_group(group, name): Metric(
        metric.unit.replace("[axis]", next((unit for unit, named in _GROUPS.items() if named == group), "[axis]")),
        f"{metric.meaning}; {_WHICH[group]}",
        metric.name.format(group) if name.startswith("error_") or group != _ALL else metric.name.replace(", {}", ""),
    )
    for name, metric in _OF_OUTPUTS.items()
    for group in (*_GROUPS.values(), _ALL)
} | {
    _TURN: Metric(
        "rad", "rms angle of the rotation between attitude and target, at any attitude", "orientation error, rms"
    ),
    "input_rms": Metric("[input]", "rms of the applied input over all inputs", "input, rms"),
    "input_peak": Metric("[input]", "largest applied input", "input, largest"),
    "input_variation": Metric(
        "[input]/s", "total variation of the input per second, mean over inputs (chattering)", "input variation"
    ),
    "energy": Metric(
        "J",
        "electrical energy supplied: energy_source of the energy ledger, or, without one, the power at the samples by "
        "the trapezium rule",
        "energy",
    ),
    # Infinite if it never settles; not defined for a reference that moves until the end.
    "settling_time": Metric(
        "s",
        "time after which the reference rests and the error stays within 2 % of the step, at least for the last 10 % "
        "of the run",
        "settling time",
    ),
    "saturated_fraction": Metric(
        "", "share of the time, mean over inputs, at which an input is saturated", "time at the input limits"
    ),
    "bad_readings": Metric(
        "", "number of readings that were not finite, left out or replaced by expected values", "bad readings"
    ),
    "nees": Metric(
        "",
        "normalised estimation error squared of position, velocity and attitude, mean; 9 where the errors of the "
        "navigation filter are as large as it says",
        "consistency of the filter (NEES)",
    ),
    "energy_balance_residual": Metric(
        "",
        "residual of the energy balance as a share of the energy supplied, due to rounding",
        "energy balance, residual",
    ),
    "energy_integration_residual": Metric(
        "",
        "the same residual computed from the state, due to the integrator",
        "energy balance from the state, residual",
    ),
    "rules": Metric("", "fuzzy rules per axis", "fuzzy rules per axis"),
}

# Metric -> the same of each output, in its own unit.
PER_AXIS = {of_group(group, name): f"{name}_axes" for group in _WHICH for name in _OF_OUTPUTS}
PER_AXIS |= {"settling_time": "settling_time_axes"}

# Known once a run is over, from its record or its law: campaigns keep no record, and have none of them.
_AFTERWARDS = ("energy_balance_residual", "energy_integration_residual", "rules")

# Metric of the outputs -> the signal that it needs.
_NEEDED = {f"{name}_rms": needed[0] for name, (needed, _) in _RMS.items()}
_NEEDED |= {"error_max": "error", "weights_peak": "weights"}


def meanings(loop: ClosedLoop, user_metrics: Sequence[AbstractMetric] = ()) -> dict[str, Metric]:
    """Metrics that a run of a loop may have, by name, in the order of tables, with their units for its plant.

    Raises:
        BadInput: two metrics have the same name.
    """
    plant, signals = loop.plant, loop.signals()
    possible = {name for name, needed in _NEEDED.items() if needed in signals}
    own_groups = {of_group(group, name) for group in output_groups(plant.output_units) for name in possible}
    unavailable = {of_group(group, name) for group in (*_GROUPS.values(), _ALL) for name in _OF_OUTPUTS} - own_groups
    unavailable |= set() if euler_places(plant.outputs) else {_TURN}
    unavailable |= set() if "nees" in signals else {"nees"}
    metrics = {name: metric for name, metric in MEANINGS.items() if name not in unavailable}
    for metric in user_metrics:
        for name, meaning in metric.metrics().items():
            if name in metrics:
                raise BadInput("metrics", "have names of their own", f"a second `{name}`")
            metrics[name] = meaning
    unit = lambda metric: Signal((), metric.unit, "").unit_for(plant.output_units, plant.input_unit)
    return {name: metric._replace(unit=unit(metric)) for name, metric in metrics.items()}


def gathered_meanings(loop: ClosedLoop, user_metrics: Sequence[AbstractMetric] = ()) -> dict[str, Metric]:
    """Those of `meanings` that are gathered along a run: what `results_of_batch` gives."""
    return {name: metric for name, metric in meanings(loop, user_metrics).items() if name not in _AFTERWARDS}


def titled_name(metric: str) -> str:
    """A metric in a few words, for headings; its key with spaces where it is not one of undertow's."""
    return MEANINGS[metric].name if metric in MEANINGS else metric.replace("_", " ")
