"""The theory of a controller: what is known of it without running it. Each controller registers what it has."""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.certificate.function import Lyapunov
from undertow.analysis.certificate.hypotheses import Hypothesis
from undertow.core.contracts import AbstractController


class RunCertificate(NamedTuple):
    """What the stability proof of a controller says about one recorded run."""

    function: Lyapunov  # along the whole record
    hypotheses: Sequence[Hypothesis]  # up to the end of the run
    numbers: Mapping[str, Any]  # further results, for metrics.json


class Theory(NamedTuple):
    """Closed forms and bounds of one controller. What is left out is not known.

    Attributes:
        poles: closed-loop poles of one axis whose actuators have no lag, each with its meaning, 1/s.
        estimator: natural frequency (rad/s) and damping ratio of the estimator of one axis.
        ramp_error: steady |d_hat - d| per |d_dot| of one axis, s.
        drift_bound: of one axis at a sampling time (s): the largest gain that drifting weights can add, and the gain at
            which the sampled estimator becomes unstable, 1/s.
        limits: meaning and largest size of signals that the controller bounds, per axis.
        at_rest: what is linearised instead of it, without what learns along a moving reference; None: itself.
        adapts: whether it has weights that a linearisation holds constant.
        thinnest_layer: at a sampling time (s): the thinnest boundary layer without chattering, and the present one.
        certificate: of a run, given the record up to its end, steady window (s), and sampling time (s).
    """

    poles: Callable[[int], list[tuple[str, complex]]] = lambda axis: []
    estimator: Callable[[int], tuple[float, float] | None] = lambda axis: None
    ramp_error: Callable[[int], float | None] = lambda axis: None
    drift_bound: Callable[[int, float], tuple[float, float] | None] = lambda axis, dt: None
    limits: Mapping[str, tuple[str, Any]] = {}
    at_rest: AbstractController | None = None
    adapts: bool = False
    thinnest_layer: Callable[[float], tuple[float, float]] | None = None
    certificate: Callable[[xr.Dataset, xr.Dataset, "SteadyWindow", float], RunCertificate] | None = None


class SteadyWindow(NamedTuple):
    """A span of time; both ends count."""

    start: float  # s
    stop: float  # s

    def inside(self, time: np.ndarray) -> np.ndarray:
        """Which instants are inside; times of records are multiples of a step in floating point."""
        return (time >= self.start - 1e-9) & (time <= self.stop + 1e-9)

    def shares(self, held: np.ndarray, time: np.ndarray) -> dict[str, float | None]:
        """Shares of the whole run and of this window in which something held; None where there are no records."""
        share = lambda some: float(some.mean()) if some.size else None
        return {"whole": share(held), "steady": share(held[self.inside(time)])}


@functools.singledispatch
def theory_of(controller: AbstractController) -> Theory:
    """What is registered for the class of a controller or the nearest class above it; else an empty theory."""
    return Theory()


register = theory_of.register  # decorator of the function that gives the theory of a class of controllers
