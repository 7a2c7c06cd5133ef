"""Theory of the paper's law: sections 3.2 to 3.8 of the theory page, and the certificate of Eq. (46)."""

import numpy as np
import xarray as xr

from undertow.analysis import drift, small_signal
from undertow.analysis.certificate import hypotheses
from undertow.analysis.certificate.function import lyapunov_residual, of_paper
from undertow.analysis.theory.contract import RunCertificate, SteadyWindow, Theory, register
from undertow.control.controllers.composite_law import RCAF


@register(RCAF)
def theory(law: RCAF) -> Theory:
    """Closed forms where the law has slopes; a bound on drift where its basis depends on the modelling error alone."""
    bounds = {"robust_term": ("robust term", law.robust_gain), "estimate": ("estimate", law.weights_bound)}
    theory_of_law = Theory(
        limits=bounds,
        adapts=law.fuzzy.rules > 1,
        thinnest_layer=lambda dt: _layers(law, dt),
        certificate=lambda run, lived, window, dt: _certificate(law, run, lived, window),
    )
    if "sign" in (law.switching, law.identification.switching):
        return theory_of_law
    theory_of_law = theory_of_law._replace(
        poles=lambda axis: [("Table 1's four states", complex(pole)) for pole in small_signal.poles(law, axis)],
        estimator=lambda axis: _estimator(law, axis),
        ramp_error=lambda axis: small_signal.ramp_error(law, axis)[1],
    )
    if law.fuzzy.inputs != 1 or (law.method, law.substeps) != ("euler", 1):
        return theory_of_law
    return theory_of_law._replace(
        drift_bound=lambda axis, dt: (drift.gain_bound(law, axis), drift.largest_gain(law, dt, axis))
    )


def _estimator(law: RCAF, axis: int) -> tuple[float, float] | None:
    frequency = small_signal.observer_frequency(law, axis)
    return (frequency, small_signal.observer_damping(law, axis)) if frequency > 0 else None


def _layers(law: RCAF, dt: float) -> tuple[float, float]:
    """The robust term chatters where its boundary layer is thinner than w_bar p22 dt."""
    least = np.max(np.asarray(law.robust_gain) * np.asarray(law.lyapunov())[..., 1, 1]) * dt
    return float(least), float(np.min(np.asarray(law.layer)))


def _certificate(law: RCAF, run: xr.Dataset, lived: xr.Dataset, window: SteadyWindow) -> RunCertificate:
    """U9: on average 1/2 E^T Q E ends below the residual, while all hypotheses hold."""
    bound = np.broadcast_to(law.weights_bound, run.sizes["axis"])
    steady_decay = lived["lyapunov_decay"].values[window.inside(lived["time"].values)]
    numbers = {
        "residual": lyapunov_residual(law, run.sizes["axis"]),
        "decay": float(steady_decay.mean()) if steady_decay.size else None,
        "weights_bound": bound.tolist(),
    }
    conditions = [*hypotheses.of_any(law, bound, lived), *hypotheses.of_paper(law, lived)]
    return RunCertificate(of_paper(law, run), conditions, numbers)
