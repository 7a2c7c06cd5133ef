"""Audit of the paper's claims C1 to C14, in a file for each subject.

Each claim has its runs and a function that judges them (`finding.claim`): `holds`, `holds if ...`, `fails` or `open`,
with the simulated fidelity levels and duration.
"""

from collections.abc import Mapping
from typing import Any

from undertow.paper.claims import estimation as estimation
from undertow.paper.claims import frequency as frequency
from undertow.paper.claims import fuzzy_input as fuzzy_input
from undertow.paper.claims import gain_matrices as gain_matrices
from undertow.paper.claims import lyapunov as lyapunov
from undertow.paper.claims import other_plants as other_plants
from undertow.paper.claims import robustness as robustness
from undertow.paper.claims import thrusters as thrusters
from undertow.paper.claims import tracking as tracking
from undertow.paper.claims.finding import CLAIMS, Scenarios
from undertow.paper.running import BatchedRun
from undertow.scenario.results.run_result import ScenarioResult


def scenarios(quick: bool) -> Scenarios:
    """Runs of the audit besides the examples, by name; fewer points of the sweeps when quick."""
    return {name: scenario for claim in CLAIMS for name, scenario in claim.scenarios(quick).items()}


def batched(quick: bool) -> Scenarios:
    """Sampled scenarios of which metrics are enough, by name."""
    return {name: scenario for claim in CLAIMS for name, scenario in claim.batched(quick).items()}


def audit(runs: Mapping[str, ScenarioResult], long: Mapping[str, BatchedRun]) -> list[dict[str, Any]]:
    """Verdicts with evidence, as in results.json.

    Args:
        runs: runs of `scenarios` and of the examples.
        long: runs of `batched`, of the long horizon and of the map of lags.
    """
    rows = []
    for claim in CLAIMS:
        finding = claim.judge(runs, long)
        verdict = {"verdict": finding.verdict, "evidence": finding.evidence, "simulated": finding.simulated}
        scenario_file = f"scenarios/{finding.shown_by}.yaml" if finding.shown_by else None
        about = {"id": claim.id, "claim": claim.text}
        numbers = dict(finding.numbers)
        rows.append({**about, **verdict, "scenario": scenario_file, "numbers": numbers})
    return rows
