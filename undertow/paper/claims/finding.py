"""A claim with its runs and its verdict, and comparisons that several claims share."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from undertow.core.status import Status
from undertow.paper.all_outputs import with_all_outputs
from undertow.paper.setup import equal_gain_ratio
from undertow.scenario.results.run_result import ScenarioResult

Runs = Mapping[str, ScenarioResult]
Scenarios = dict[str, dict[str, Any]]


class ClaimVerdict(NamedTuple):
    """Verdict on one claim."""

    verdict: str
    evidence: str
    shown_by: str | None  # name of the scenario of the evidence
    simulated: str  # fidelity levels, conditions and duration
    numbers: Mapping[str, Any] = MappingProxyType({})


class Claim(NamedTuple):
    """A claim of the paper, and how it is judged."""

    id: str  # C1 to C14
    text: str
    judge: Callable[[Runs, Any], ClaimVerdict]  # from the runs, and the batched runs
    scenarios: Callable[[bool], Scenarios]  # runs besides the examples, by name; fewer points of the sweeps when quick
    batched: Callable[[bool], Scenarios]  # sampled ones of which metrics are enough


CLAIMS: list[Claim] = []


def claim(
    id: str, text: str, scenarios: Any = lambda quick: {}, batched: Any = lambda quick: {}
) -> Callable[[Any], Any]:
    """Register the function that judges a claim; see `Claim`."""

    def register(judge: Callable[[Runs, Any], ClaimVerdict]) -> Callable[[Runs, Any], ClaimVerdict]:
        CLAIMS.append(Claim(id, text, judge, scenarios, batched))
        CLAIMS.sort(key=lambda entry: int(entry.id[1:]))
        return judge

    return register


# RAFC with gamma raised until its low-frequency loop gain equals that of RCAFC, for a fair comparison.
EQUAL_GAIN = "rafc_equal_gain"


def steady(run: ScenarioResult) -> dict[str, Any]:
    """Steady metrics of a run that reached its end.

    Raises:
        RuntimeError: it did not.
    """
    if run.steady is None:
        raise RuntimeError(f"a run of the audit ended early: {run.status.word} ({run.built.scenario.description})")
    return with_all_outputs(run.steady)


def tracking_error(run: ScenarioResult) -> float | None:
    """Steady tracking rms, m and rad; None for a run that ended early."""
    return steady(run)["tracking_rms"] if run.status is Status.OK else None


def at_table_1(runs: Runs, metric: str, what: str, unit: str) -> tuple[str, dict[str, float]]:
    """A steady metric of RCAFC and RAFC (Example 1), at the paper's gains and at equal tuning: sentence and numbers."""
    rcafc, rafc, fair = (steady(runs[name])[metric] for name in ("ideal_rcafc", "ideal_rafc", EQUAL_GAIN))
    text = (
        f"{what} of RCAFC {rcafc:.3g} {unit}, RAFC {rafc:.3g} {unit} ({rafc / rcafc:.1f} times) at Table 1; "
        f"RAFC with gamma raised {equal_gain_ratio():.0f} times, to the same loop gain: {fair:.3g} {unit} "
        f"({fair / rcafc:.2f} times)."
    )
    return text, {"rcafc": rcafc, "rafc": rafc, EQUAL_GAIN: fair}
