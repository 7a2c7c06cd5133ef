"""Metrics of a run, predicted by driving the linearised loop with the loads along the reference."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.analysis.linearization.disturbance_profile import DisturbanceProfile
from undertow.analysis.linearization.equilibrium import Equilibrium
from undertow.analysis.linearization.linear_loop import LinearLoop
from undertow.analysis.linearization.minimal_realization import visible
from undertow.analysis.metrics import of_group, output_groups
from undertow.core.arrays import as_array
from undertow.core.kept_programs import briefly_compiled

_ENTRIES = ("load", "noise")
_START = "start"  # a column: where the states are at first


class MetricComparison(NamedTuple):
    """One metric, predicted and found."""

    name: str
    predicted: float
    measured: float

    @property
    def departure(self) -> float:
        """Of the measured from the predicted, as a share of the predicted; zero where both are, infinite from zero."""
        if self.predicted == 0:
            return 0.0 if self.measured == 0 else float("inf")
        return abs(self.measured - self.predicted) / self.predicted


def signals_within(
    at: Equilibrium, loop: LinearLoop, around: DisturbanceProfile, window: tuple[float, float], every: int = 1
) -> dict[str, np.ndarray]:
    """Predicted signals at the records of a window, arrays (records, entries) by name.

    Args:
        at: the loop at rest under the mean load of the window.
        loop: the same, closed, with a start; see `from_start`.
        around: what acts.
        window: start and stop, s.
        every: steps per record; metrics are those of the records, as in a run.
    """
    small = visible(loop, (*_ENTRIES, _START), tuple(loop.signals))
    entry = np.hstack([small.entries[name] for name in _ENTRIES])
    driven = np.hstack([around.load - at.at["load"], around.noise])
    states = np.asarray(_driven(*map(as_array, (small.entries[_START][:, 0], small.matrix, entry, driven))))
    hair = loop.dt / 2
    recorded = np.arange(len(around.time)) % every == 0
    inside = recorded & (around.time >= window[0] - hair) & (around.time <= window[1] + hair)
    signals = {}
    for name in loop.signals:
        direct = np.hstack([loop.direct[name][way] for way in _ENTRIES])
        departure = states @ small.signals[name].T + driven @ direct.T
        signals[name] = (at.local.values[name] + departure)[inside]
    return signals


def metrics_of(signals: dict[str, np.ndarray], units: Sequence[str]) -> dict[str, float]:
    """Metrics of predicted signals, by the names of results files; `units` are those of the outputs."""
    rms = lambda values: float(np.sqrt((values**2).mean()))
    named = {"error": "error", "uncertainty": "uncertainty", "modelling_error": "model", "robust_term": "robust"}
    of_outputs = {metric: signals[name] for name, metric in named.items() if name in signals}
    if "estimate" in signals:
        of_outputs["estimation"] = signals["estimate"] - signals["uncertainty"]
    metrics = {}
    for group, (_, axes) in output_groups(units).items():
        metrics |= {of_group(group, f"{name}_rms"): rms(values[:, axes]) for name, values in of_outputs.items()}
        metrics[of_group(group, "error_max")] = _peak(signals["error"][:, axes])
    return metrics | {"input_rms": rms(signals["u"]), "input_peak": _peak(signals["u"])}


def _peak(values: np.ndarray) -> float:
    return float(np.abs(values).max())


def from_start(loop: LinearLoop, at: Equilibrium, plant: np.ndarray, law: np.ndarray) -> LinearLoop:
    """The loop with states of plant and law at the first instant, as vectors of `Parts`."""
    away = np.concatenate([(plant - at.at["plant"])[at.acting], law - at.at["law"]])
    return loop._replace(entries=loop.entries | {_START: away[:, None]})


def compare_metrics(predicted: Mapping[str, float], measured: Mapping[str, Any]) -> list[MetricComparison]:
    """Predicted metrics beside the measured ones of the same names."""
    return [MetricComparison(name, value, measured[name]) for name, value in predicted.items() if name in measured]


@briefly_compiled
def _driven(start, matrix, entry, driven):
    """States at each step."""

    def step(state, w):
        return matrix @ state + entry @ w, state

    return jax.lax.scan(step, start, driven)[1]
