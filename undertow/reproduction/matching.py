"""Gains that make two laws comparable: what differs is then the law, not how hard it was tuned."""

from typing import Any

from undertow.analysis.small_signal import gains
from undertow.controllers.presets.paper import paper
from undertow.plants.double_integrator import double_integrator

_GAMMA = 100.0  # Table 1


def equal_gain() -> dict[str, Any]:
    """Gains of RAFC tuned as hard as RCAFC: gamma such that gamma (p12 / (k1 + kr p12)) equals RCAFC's loop gain.

    By section 3.1 the loop gain at low frequency is gamma rho [p12 / k1' + gamma_eps / a1] / p, with k1' the
    effective position gain and a1 the effective pole of the identification model.
    """
    return {"adaptation": round(_GAMMA * equal_gain_ratio(), 1)}


def equal_gain_ratio() -> float:
    """How much larger the low-frequency loop gain of RCAFC is than that of RAFC, at Table 1: about 68."""
    g = gains(paper(double_integrator(1).model()))
    tracking_branch = g.p12 / g.stiffness
    return (tracking_branch + g.composite / g.pole) / tracking_branch


def same_loop_gain(fuzzy_input: str, sets: int) -> dict[str, Any]:
    """A fuzzy system with the gamma |xi|^2 of Table 1 with five sets on the modelling error. Section 3.1."""
    matched = _GAMMA * _basis_norm_squared("error", 5) / _basis_norm_squared(fuzzy_input, sets)
    return {"fuzzy_input": fuzzy_input, "sets": sets, "adaptation": round(matched, 3)}


def _basis_norm_squared(fuzzy_input: str, sets: int) -> float:
    """|xi|^2 at zero."""
    return float(paper(double_integrator(1).model(), fuzzy_input=fuzzy_input, sets=sets).fuzzy.basis_norm_squared())
