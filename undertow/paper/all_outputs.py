"""The paper's metrics: one number over six outputs, metres and radians together."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from undertow.analysis.metrics import MEANINGS, of_group, output_groups

# Its own -> the metric of each output.
_RMS = {"tracking_rms": "error_rms"} | {
    f"{of}_rms": f"{of}_rms" for of in ("estimation", "uncertainty", "robust", "model")
}
_GROUPS = tuple(output_groups(("m", "rad")))
_PEAK = {"tracking_max": "error_max", "weights_peak": "weights_peak"}


def with_all_outputs(metrics: Mapping[str, Any] | None) -> Any:
    """Metrics of a run with the rms and the largest over all outputs, m and rad; None stays None.

    The tables of Section 5 compare laws by one figure; it is used in the reproduction only.
    """
    if metrics is None:
        return None
    of = lambda names: {
        name: metrics[f"{metric}_axes"] for name, metric in names.items() if f"{metric}_axes" in metrics
    }
    rms = {name: float(np.sqrt(np.mean(np.square(axes)))) for name, axes in of(_RMS).items()}
    return {**metrics, **rms} | {name: float(np.max(axes)) for name, axes in of(_PEAK).items()}


def of_columns(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same from metrics of many runs, of groups of equal size: outputs in m and, for a vehicle, in rad."""
    combined = {}
    for name, metric in (_RMS | _PEAK).items():
        groups = [columns[column] for group in _GROUPS if (column := of_group(group, metric)) in columns]
        defined = [group for group in groups if not np.isnan(group).all()] or groups
        if defined:
            combined[name] = np.sqrt(np.mean(np.square(defined), axis=0)) if name in _RMS else np.max(defined, axis=0)
    return combined


def unit_of(metric: str) -> str:
    """Unit of a metric of the paper's vehicle: outputs in m and rad, inputs in V."""
    unit = MEANINGS[metric].unit.replace("[input]", "V")
    return f"{unit.replace('[axis]', 'm')}, {unit.replace('[axis]', 'rad')}" if "[axis]" in unit else unit
