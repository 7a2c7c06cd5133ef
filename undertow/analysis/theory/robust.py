"""Theory of the robust variant: poles of its estimator and tracking, drift, and the certificate of section X4."""

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

from undertow.analysis import drift
from undertow.analysis.certificate import hypotheses
from undertow.analysis.certificate.function import estimation_bound, fastest_uncertainty, of_robust
from undertow.analysis.small_signal import of_axis
from undertow.analysis.theory.contract import RunCertificate, SteadyWindow, Theory, register
from undertow.control.controllers.law_signals import INERTIA
from undertow.control.controllers.robust.knowledge import regressor_names, strongest
from undertow.control.controllers.robust.robust_law import RobustRCAF


@register(RobustRCAF)
def theory(law: RobustRCAF) -> Theory:
    """Closed forms of the law on axes whose actuators follow the command at once."""
    at = lambda value, axis: float(of_axis(law, value, axis))
    estimator = lambda axis: (at(law.estimator.bandwidth, axis), at(law.estimator.damping, axis))
    return Theory(
        poles=lambda axis: _poles(law, axis, *estimator(axis)),
        estimator=estimator,
        ramp_error=lambda axis: 2 * estimator(axis)[1] / estimator(axis)[0],
        drift_bound=lambda axis, dt: (drift.gain_bound(law, axis), drift.largest_gain(law, dt, axis)),
        limits={"robust_term": ("robust term", law.robust_gain), "estimate": ("estimate", law.weights_bound)},
        at_rest=None if law.memory is None else dataclasses.replace(law, memory=None),
        certificate=lambda run, lived, window, dt: _certificate(law, run, lived, window, dt),
    )


def _poles(law: RobustRCAF, axis: int, frequency: float, damping: float) -> list[tuple[str, complex]]:
    k, p = of_axis(law, law.feedback, axis, 2), of_axis(law, law.lyapunov(), axis, 2, 2)
    slope = of_axis(law, law.robust_gain, axis) / of_axis(law, law.layer, axis)
    tracking = np.roots([1.0, k[1] + slope * p[1, 1], k[0] + slope * p[0, 1]])
    observer = np.roots([1.0, 2 * damping * frequency, frequency**2])
    return [("estimator", complex(pole)) for pole in observer] + [("tracking", complex(pole)) for pole in tracking]


def _certificate(
    law: RobustRCAF, run: xr.Dataset, lived: xr.Dataset, window: SteadyWindow, dt: float
) -> RunCertificate:
    """With the estimation error allowed by the largest |d_dot| from record to record, and how often it was kept."""
    bound = np.broadcast_to(law.estimator.bound, run.sizes["axis"])
    rate = fastest_uncertainty(lived)
    allowed = estimation_bound(law.estimator, dt, rate)
    error = np.abs(lived["estimate"].values - lived["uncertainty"].values)
    within_bound = np.all(error <= allowed + hypotheses.ROUNDING, axis=-1)
    numbers = {
        "uncertainty_rate": rate.tolist(),
        "estimation_bound": allowed.tolist(),
        "estimation_within": window.shares(within_bound, lived["time"].values),
        "weights_bound": bound.tolist(),
    }
    if law.memory is not None:
        numbers |= _learnt(law, lived)
    conditions = [*hypotheses.of_any(law, bound, lived), *hypotheses.of_robust(law, lived)]
    return RunCertificate(of_robust(law, run, dt), conditions, numbers)


def _learnt(law: RobustRCAF, lived: xr.Dataset) -> dict[str, Any]:
    """The largest weights of each axis at the end, and how much of the memory was used at least."""
    memory, coordinates = law.memory, law.model.coordinates
    assert memory is not None
    axes = list(coordinates.axes) or [str(name) for name in lived["axis"].values]
    names = regressor_names(axes, memory.fuzzy.rules, memory.regressor, bool(coordinates.axes))
    weights, variance = (lived[f"memory_{name}"].values[-1] for name in ("weights", "variance"))
    inertia = {name: lived[name].values[-1].tolist() for name in INERTIA if name in lived}
    return inertia | {
        "memory": [weight._asdict() for weight in strongest(weights, variance, names, axes)],
        "memory_trust": lived["memory_trust"].values.min(0).tolist(),
        "memory_bound": float(memory.bound),
    }
