"""What judging a claim yields, and the comparisons that several claims share."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from undertow.analysis.linear import gains
from undertow.controllers.presets.paper import paper
from undertow.plants.double_integrator import double_integrator
from undertow.scenario.execute import Executed
from undertow.studies.paper.setup import RAFC, scenario

Runs = Mapping[str, Executed]


class Finding(NamedTuple):
    """Verdict on one claim."""

    verdict: str
    evidence: str
    shown_by: str | None  # name of the scenario that shows it
    numbers: Mapping[str, Any] = MappingProxyType({})


# RAFC with gamma raised until its loop gain at low frequency is RCAFC's: the fair opponent.
EQUAL_GAIN = "rafc_equal_gain"


def equal_gain_scenario() -> dict[str, Any]:
    """RAFC tuned as hard as RCAFC: gamma such that gamma (p12 / (k1 + kr p12)) equals RCAFC's loop gain.

    By section 3.1 the loop gain at low frequency is gamma rho [p12 / k1' + gamma_eps / a1] / p, with k1' the
    effective position gain and a1 the effective pole of the identification model.
    """
    return scenario(
        "RAFC with gamma raised to the loop gain of RCAFC",
        composite=RAFC,
        controller={"adaptation": round(100.0 * equal_gain_ratio(), 1)},
    )


def equal_gain_ratio() -> float:
    """How much larger the low-frequency loop gain of RCAFC is than that of RAFC, at Table 1: about 68."""
    g = gains(paper(double_integrator(1).model()))
    tracking_branch = g.p12 / g.stiffness
    return (tracking_branch + g.composite / g.pole) / tracking_branch


def pair(runs: Runs, metric: str) -> tuple[float, float, float]:
    """A steady metric of RCAFC and RAFC at Table 1, and of RAFC at equal loop gain (Example 1)."""
    names = ("ideal_rcafc", "ideal_rafc", EQUAL_GAIN)
    return tuple(steady(runs[name])[metric] for name in names)


def steady(run: Executed) -> dict[str, Any]:
    """Steady metrics of a run that lasted.

    Raises:
        RuntimeError: it did not.
    """
    if run.steady is None:
        raise RuntimeError(f"a run of the audit ended early: {run.status.word} ({run.built.scenario.description})")
    return run.steady


def compared(runs: Runs, metric: str, what: str, unit: str) -> Finding:
    """Verdict on `RCAFC has a smaller <metric> than RAFC`, at the paper's gains and at equal tuning."""
    rcafc, rafc, fair = pair(runs, metric)
    numbers = {"rcafc": rcafc, "rafc": rafc, "rafc_equal_gain": fair}
    text = (
        f"{what} of RCAFC {rcafc:.3g} {unit}, RAFC {rafc:.3g} {unit} ({rafc / rcafc:.1f} times) at Table 1; "
        f"RAFC with gamma raised {equal_gain_ratio():.0f} times, to the same loop gain: {fair:.3g} {unit} "
        f"({fair / rcafc:.2f} times)."
    )
    if rcafc >= rafc:
        return Finding("fails", text, "ideal_rcafc", numbers)
    if rcafc >= fair:
        return Finding("holds if both use the gamma of Table 1; not at equal loop gain", text, EQUAL_GAIN, numbers)
    return Finding("holds", text, "ideal_rcafc", numbers)
