"""The audit: one file per claim of the paper, C1 to C14.

Each says what the claim is (`CLAIM`), what has to be run (`scenarios(quick)`, and `batched(quick)` for runs of which
metrics are enough), and what the numbers say (`judge(runs, long)`). A verdict is `holds`, `holds if ...`, `fails` or
`open`; every one says on which levels and for how long was simulated.
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
    """Every run the audit needs beyond the examples, by name; fewer points of the sweeps when quick."""
    return {name: one for module in _MODULES for name, one in module.scenarios(quick).items()}


def batched(quick: bool) -> dict[str, dict[str, Any]]:
    """Every run of which metrics are enough, by name: sampled scenarios."""
    found = [module.batched(quick) for module in _MODULES if hasattr(module, "batched")]
    return {name: one for scenarios in found for name, one in scenarios.items()}


def audit(runs: Mapping[str, Executed], long: Mapping[str, BatchResult]) -> list[dict[str, Any]]:
    """Verdicts with evidence, as they stand in results.json.

    Args:
        runs: those of `scenarios`, and of the examples.
        long: those of `batched`, of the long runs and of the map of lags.
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
