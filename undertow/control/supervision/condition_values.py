"""Values and limits of the supervisor's conditions, in the order of their table."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from undertow.control.supervision.conditions import NAMES, PerCondition
from undertow.control.supervision.measurement_gate import Passed
from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, Inputs, Target
from undertow.core.param import Param, param

Scalar = Float[Array, ""]

CLOCK_FAULT = 10.0  # sampling times between two steps
RESTART_WINDOW = 600.0  # s in which restarts count

_SWINGS = 0.8  # per second; waves of 3 s that are too large for the thrusters make them swing 0.7 times per second
_OVERRUN = 1.5  # sampling times between two steps
_NEAR_VERTICAL = np.deg2rad(75)
_INFEASIBLE = 0.05  # share of the desired acceleration


class View(NamedTuple):
    """What a step sees and decides."""

    passed: Passed
    given: Target  # the reference, or the last valid one
    r: Target  # that the law pursues
    rejected: Scalar  # entries of the reference
    controls: Bool[Array, ""]  # whether the law's command may leave
    command: Inputs  # of the law
    signals: dict[str, Array]  # of the law
    output: Inputs
    beyond: Inputs  # by which the output exceeds the law's command within limits since a transfer


class Occasion(NamedTuple):
    """What else the conditions depend on."""

    u: Inputs  # applied
    contradicted: Scalar  # log-likelihood ratio against the reported input relative to its threshold
    errors: tuple[Scalar, Scalar]  # tracking errors of position and attitude relative to the allowed ones
    variation: Scalar  # of the input, ranges per second
    swings: Scalar  # of the input from limit to limit per second, those of the thruster that swings most
    restarts: Scalar  # within `RESTART_WINDOW`
    place_held: Bool[Array, ""]  # whether the law holds a place in place of its reference
    broken: Bool[Array, ""]  # whether the state of the law is not finite
    elapsed: Scalar  # time since the last step, sampling times; NaN where the clock does not run


class ConditionValues(eqx.Module):
    """Limits that the values of conditions are compared with.

    Raises:
        BadInput: a limit is not positive.
    """

    low: Float[Param, " m"] = param("as input", "smallest input")
    high: Float[Param, " m"] = param("as input", "largest input")
    max_estimate: Float[Param, " n"] = param("as estimated", "largest plausible estimate of the uncertainty")
    max_variation: Float[Param, ""] = param("1/s", "variation of the input that counts as chattering, ranges")
    restarts: int = eqx.field(static=True, default=3)

    def __check_init__(self):
        for name in ("max_estimate", "max_variation"):
            checks.positive(name, getattr(self, name), finite=False)

    def values(self, view: View, occasion: Occasion, coordinates: AbstractCoordinates) -> PerCondition:
        """Values of all conditions; those of a law that does not control are zero."""
        passed, signals = view.passed, view.signals
        # An actuator of one direction rests at its limit of zero.
        at_limit = ((occasion.u <= self.low) & (self.low < 0)) | ((occasion.u >= self.high) & (self.high > 0))
        controlled = {
            "output_not_finite": (~jnp.isfinite(view.command)).sum(dtype=float),
            "saturated": at_limit.sum(dtype=float),
            "chattering": jnp.maximum(occasion.variation / self.max_variation, occasion.swings / _SWINGS),
            "reference_infeasible": 1 - signals.get("attained_share", jnp.ones(())),
            "position_error": occasion.errors[0],
            "attitude_error": occasion.errors[1],
        }
        values = {name: jnp.where(view.controls, value, 0.0) for name, value in controlled.items()}
        euler = passed.measurement.body is not None and not coordinates.axes
        count_of = lambda name: jnp.asarray(signals.get(name, jnp.zeros(1)), dtype=float).sum()
        values |= {
            "measurement_not_finite": passed.not_finite,
            "measurement_implausible": passed.implausible,
            "measurement_jump": passed.jump,
            "measurement_inconsistent": passed.contradiction,
            "measurement_noisy": passed.noise,
            "measurement_stuck": passed.missing,
            "report_lost": passed.unreported,
            "applied_contradicted": occasion.contradicted,
            "reference_rejected": view.rejected,
            "place_held": occasion.place_held,
            "estimator_diverged": jnp.where(occasion.broken, jnp.inf, self._estimate_ratio(view)),
            "restarts_exhausted": occasion.restarts,
            "thruster_lost": count_of("lost_thrusters"),
            "axes_lost": count_of("lost_axes"),
            "near_vertical": jnp.abs(passed.measurement.position[4]) if euler else jnp.zeros(()),
            "overrun": jnp.where(jnp.isfinite(occasion.elapsed), occasion.elapsed, 0.0),
            "clock_fault": jnp.where(occasion.elapsed <= CLOCK_FAULT, 0.0, 1.0),
        }
        return jnp.stack([jnp.asarray(values[name], dtype=float) for name in NAMES])

    def limits(self) -> PerCondition:
        """Limits of all conditions: 0 of what is counted, 1 of what is relative to a limit, and a few others."""
        counted = ("measurement_not_finite", "report_lost", "reference_rejected", "output_not_finite", "saturated")
        limits = dict.fromkeys(NAMES, 1.0) | dict.fromkeys(
            (*counted, "thruster_lost", "axes_lost", "clock_fault", "place_held"), 0.0
        )
        limits |= {
            "restarts_exhausted": float(self.restarts),
            "reference_infeasible": _INFEASIBLE,
            "near_vertical": _NEAR_VERTICAL,
            "overrun": _OVERRUN,
        }
        return jnp.stack([jnp.asarray(limits[name], dtype=float) for name in NAMES])

    def _estimate_ratio(self, view: View) -> Scalar:
        """Estimated uncertainty relative to the largest plausible one."""
        if "estimate" not in view.signals:
            return jnp.zeros(())
        ratio = (jnp.abs(view.signals["estimate"]) / self.max_estimate).max()
        return jnp.where(view.controls, ratio, 0.0)
