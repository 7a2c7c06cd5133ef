"""The certificate of a run: signals for its dataset, and a summary of how long each hypothesis held."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.certificate import hypotheses
from undertow.analysis.certificate.function import (
    Lyapunov,
    estimation_bound,
    fastest_uncertainty,
    lyapunov_residual,
    of_paper,
    of_robust,
)
from undertow.analysis.certificate.hypotheses import Hypothesis
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.contracts import AbstractController
from undertow.loop.recording import series

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
    lived = run.isel(time=run["time"].values <= run.attrs["ended"] + _HAIR)
    axes = run.sizes["axis"]
    if run.attrs["status"] != "completed":  # it has no steady window
        window = np.inf, np.inf
    if not lived.sizes["time"]:
        return None
    with np.errstate(all="ignore"):  # a run that diverged may have had any numbers
        if isinstance(controller, RCAF):
            bound = np.broadcast_to(controller.weights_bound, axes)
            function, numbers = of_paper(controller, run), _paper_numbers(controller, lived, window)
            asked = [*hypotheses.of_any(controller, bound, lived), *hypotheses.of_paper(controller, lived)]
        elif isinstance(controller, RobustRCAF):
            bound = np.broadcast_to(controller.estimator.bound, axes)
            function, numbers = of_robust(controller, run, dt), _robust_numbers(controller, lived, window, dt)
            asked = [*hypotheses.of_any(controller, bound, lived), *hypotheses.of_robust(controller, lived)]
        else:
            return None
        rate = _rate(function.value, run["time"].values)
        summary = {
            "function": function.meaning,
            "hypotheses": [_summed(one, lived["time"].values, window) for one in asked],
            **_course(function.value[: lived.sizes["time"]], lived["time"].values, window),
            **numbers,
            "weights_bound": bound.tolist(),
        }
    return Certified(_signals(function, rate), summary)


def _signals(function: Lyapunov, rate: np.ndarray) -> dict[str, xr.Variable]:
    described = {
        "lyapunov": (f"Lyapunov function: {function.meaning}", function.value, _UNITS),
        "lyapunov_estimation": ("its part that eps and the weights make", function.estimation, _UNITS),
        "lyapunov_rate": ("its mean rate since the record before", rate, "m^2/s^3, rad^2/s^3"),
    }
    return {name: series(("time",), values, meaning, units) for name, (meaning, values, units) in described.items()}


def _rate(value: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Differences of records over their distance; there is none at the first."""
    return np.concatenate([[np.nan], np.diff(value) / np.diff(time)])


def _summed(one: Hypothesis, time: np.ndarray, window: tuple[float, float]) -> dict[str, Any]:
    known = {"name": one.name, "sentence": one.sentence}
    if one.held is None:
        return known | {"whole": None, "steady": None, "first_failure": None, "unknown": one.unknown}
    broken = time[~one.held]
    return known | _shares(one.held, time, window) | {"first_failure": float(broken[0]) if broken.size else None}


def _course(value: np.ndarray, time: np.ndarray, window: tuple[float, float]) -> dict[str, Any]:
    """Where V began and ended, and the share of steps from record to record at which it rose."""
    rises = np.diff(value) > _RISE * value.max()
    ends = {"start": float(value[0]), "end": float(value[-1]), "largest": float(value.max())}
    return ends | {"rising": _shares(rises, time[1:], window)}


def _paper_numbers(law: RCAF, run: xr.Dataset, window: tuple[float, float]) -> dict[str, Any]:
    """U9: on average 1/2 E^T Q E ends below the residual, while all hypotheses hold."""
    late = run["lyapunov_decay"].values[_inside(run["time"].values, window)]
    return {
        "residual": lyapunov_residual(law, run.sizes["axis"]),
        "decay": float(late.mean()) if late.size else None,
    }


def _robust_numbers(law: RobustRCAF, run: xr.Dataset, window: tuple[float, float], dt: float) -> dict[str, Any]:
    """Estimation error allowed by the largest |d_dot| from record to record, and how often it was kept."""
    rate = fastest_uncertainty(run)
    allowed = estimation_bound(law.estimator, dt, rate)
    kept = (np.abs(run["estimate"].values - run["uncertainty"].values) <= allowed + hypotheses.ROUNDING).all(-1)
    return {
        "uncertainty_rate": rate.tolist(),
        "estimation_bound": allowed.tolist(),
        "estimation_within": _shares(kept, run["time"].values, window),
    }


def _shares(held: np.ndarray, time: np.ndarray, window: tuple[float, float]) -> dict[str, float | None]:
    """Of the time, over the whole run and the steady window; None where there are no records."""
    share = lambda some: float(some.mean()) if some.size else None
    return {"whole": share(held), "steady": share(held[_inside(time, window)])}


def _inside(time: np.ndarray, window: tuple[float, float]) -> np.ndarray:
    return (time >= window[0] - _HAIR) & (time <= window[1] + _HAIR)
