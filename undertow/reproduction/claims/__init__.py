"""Audit of the paper's claims C1 to C14, one file each.

Each file has the claim (`CLAIM`), its runs (`scenarios(quick)`, and `batched(quick)` for runs of which metrics are
enough), and the verdict (`judge(runs, long)`): `holds`, `holds if ...`, `fails` or `open`, with the simulated fidelity
levels and duration.
"""

import importlib
import pkgutil
from collections.abc import Mapping
from typing import Any

from undertow.reproduction.running import BatchResult
from undertow.scenario.execute import Executed

_MODULES = [
    importlib.import_module(f"{__name__}.{info.name}")
    for info in sorted(pkgutil.iter_modules(__path__), key=lambda info: info.name)
    if info.name[0] == "c" and info.name[1:3].isdigit()
]


def scenarios(quick: bool) -> dict[str, dict[str, Any]]:
    """Runs of the audit besides the examples, by name; fewer points of the sweeps when quick."""
    return {name: one for module in _MODULES for name, one in module.scenarios(quick).items()}


def batched(quick: bool) -> dict[str, dict[str, Any]]:
    """Sampled scenarios of which metrics are enough, by name."""
    found = [module.batched(quick) for module in _MODULES if hasattr(module, "batched")]
    return {name: one for scenarios in found for name, one in scenarios.items()}


def audit(runs: Mapping[str, Executed], long: Mapping[str, BatchResult]) -> list[dict[str, Any]]:
    """Verdicts with evidence, as in results.json.

    Args:
        runs: runs of `scenarios` and of the examples.
        long: runs of `batched`, of the long horizon and of the map of lags.
    """
    found = []
    for module in _MODULES:
        finding = module.judge(runs, long)
        found.append(
            {
                "id": f"C{int(module.__name__.rsplit('.', 1)[1][1:3])}",
                "claim": module.CLAIM,
                "verdict": finding.verdict,
                "evidence": finding.evidence,
                "simulated": finding.simulated,
                "scenario": f"scenarios/{finding.shown_by}.yaml" if finding.shown_by else None,
                "numbers": dict(finding.numbers),
            }
        )
    return found
