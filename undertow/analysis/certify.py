"""The certificate of a run: signals for its dataset, and a summary of how long each hypothesis held."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.certificate.function import Lyapunov
from undertow.analysis.certificate.hypotheses import Hypothesis
from undertow.analysis.theory import SteadyWindow, theory_of
from undertow.core.contracts import AbstractController
from undertow.simulation.loop.dataset import series

# V rises where it grows by more than this share of its largest value.
_RISE = 1e-10

# Times of records are multiples of a step in floating point.
_HAIR = 1e-9  # s

_UNITS = "m^2/s^2, rad^2/s^2"


class Certified(NamedTuple):
    """What is known about the stability of one run."""

    signals: dict[str, xr.Variable]  # to stand beside the recorded ones
    summary: dict[str, Any]  # as it stands in metrics.json


def certify(
    run: xr.Dataset, controller: AbstractController, window: tuple[float, float], dt: float
) -> Certified | None:
    """Lyapunov function along a recorded run, and the hypotheses under which it cannot rise.

    Args:
        run: recorded series; what comes after `ended` counts for nothing.
        controller: the law that ran.
        window: start and stop of the steady window, s.
        dt: sampling time of the controller, s.

    Returns:
        None for a law whose Lyapunov function is not known here.
    """
    parts = theory_of(controller).certificate
    records = run["time"].values <= run.attrs["ended"] + _HAIR
    lived = run if records.all() else run.isel(time=records)
    if parts is None or not lived.sizes["time"]:
        return None
    steady = SteadyWindow(*window) if run.attrs["status"] == "completed" else SteadyWindow(np.inf, np.inf)
    time = lived["time"].values
    with np.errstate(all="ignore"):  # a run that diverged may have had any numbers
        function, hypotheses, numbers = parts(run, lived, steady, dt)
        rate = np.concatenate([[np.nan], np.diff(function.value) / np.diff(run["time"].values)])
        summary = {
            "function": function.meaning,
            "hypotheses": [_summed(hypothesis, time, steady) for hypothesis in hypotheses],
            **_course(function.value[: len(time)], time, steady),
            **numbers,
        }
    return Certified(_signals(function, rate), summary)


def _signals(function: Lyapunov, rate: np.ndarray) -> dict[str, xr.Variable]:
    signal_data = {
        "lyapunov": (f"Lyapunov function: {function.meaning}", function.value, _UNITS),
        "lyapunov_estimation": ("its part that eps and the weights make", function.estimation, _UNITS),
        "lyapunov_rate": ("its mean rate since the record before", rate, "m^2/s^3, rad^2/s^3"),
    }
    return {
        name: series(("time",), values, meaning, units)
        for name, (meaning, values, units) in signal_data.items()
        if values is not None
    }


def _summed(hypothesis: Hypothesis, time: np.ndarray, window: SteadyWindow) -> dict[str, Any]:
    summary = {"name": hypothesis.name, "sentence": hypothesis.sentence}
    if hypothesis.held is None:
        return summary | {"whole": None, "steady": None, "first_failure": None, "unknown": hypothesis.unknown}
    failure_times = time[~hypothesis.held]
    first_failure = float(failure_times[0]) if failure_times.size else None
    return summary | window.shares(hypothesis.held, time) | {"first_failure": first_failure}


def _course(value: np.ndarray, time: np.ndarray, window: SteadyWindow) -> dict[str, Any]:
    """Where V began and ended, and the share of steps from record to record at which it rose."""
    rises = np.diff(value) > _RISE * value.max()
    ends = {"start": float(value[0]), "end": float(value[-1]), "largest": float(value.max())}
    return ends | {"rising": window.shares(rises, time[1:])}
