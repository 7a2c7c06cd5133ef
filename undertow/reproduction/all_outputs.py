"""The paper's error metrics: one number over six outputs, metres and radians together."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from undertow.analysis.metrics import MEANINGS

RMS, PEAK = "tracking_rms", "tracking_max"


def with_all_outputs(metrics: Mapping[str, Any] | None) -> Any:
    """Metrics of a run with the rms and the largest of the error over all outputs, m and rad; None stays None.

    The tables of Section 5 compare laws by one figure; it is used in the reproduction only.
    """
    if metrics is None or "error_rms_axes" not in metrics:
        return metrics
    rms = float(np.sqrt(np.mean(np.square(metrics["error_rms_axes"]))))
    return {**metrics, RMS: rms, PEAK: float(np.max(metrics["error_max_axes"]))}


def unit_of(metric: str) -> str:
    """Unit of a metric of the paper's vehicle: outputs in m and rad, inputs in V."""
    unit = MEANINGS[metric].unit.replace("[input]", "V")
    return f"{unit.replace('[axis]', 'm')}, {unit.replace('[axis]', 'rad')}" if "[axis]" in unit else unit
