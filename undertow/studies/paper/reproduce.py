"""`undertow reproduce`: every figure and table of the paper, and the audit of its claims."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from undertow.scenario.execute import Executed
from undertow.scenario.labelling import to_json
from undertow.scenario.provenance import versions
from undertow.studies.paper import claims, examples
from undertow.studies.paper.experiments import run_all
from undertow.studies.paper.setup import CONTROLLERS
from undertow.studies.paper.thruster_response import ThrusterResponse, thruster_response
from undertow.studies.sound.chapter import chapter

Progress = Callable[[str, float], None]

# Share of the work that the paper's runs take, and with the last chapter; the rest is drawing.
_PAPER, _RUNNING = 0.25, 0.9


class Reproduction(NamedTuple):
    """Everything `undertow reproduce` finds out, before it is drawn."""

    results: dict[str, Any]  # what stands in results.json
    runs: dict[str, Executed]
    response: ThrusterResponse

    def datasets(self, rung: str) -> dict[str, xr.Dataset]:
        """Recorded series on a rung of the ladder, by controller. Examples 1 and 2 are `ideal` and `static`."""
        return {name: self.runs[f"{rung}_{name}"].dataset for name in CONTROLLERS}


def reproduce(folder: Path, quick: bool, progress: Progress, sound: bool = True) -> Reproduction:
    """Run the paper and audit it; writes `runs/`, `scenarios/` and `results.json` into a folder.

    Args:
        folder: an existing, empty folder.
        quick: fewer points in the sweeps; the same accuracy.
        progress: told a message and the share done.
        sound: whether to run the last chapter, the sound version beside the paper's.
    """
    wanted = examples.scenarios() | claims.scenarios(quick)
    runs = run_all(wanted, folder, lambda message, share: progress(message, _PAPER * share))
    progress("judging the claims", _PAPER)
    results = {
        "provenance": {"quick": quick, "scenarios": sorted(wanted), **versions()},
        "example1": examples.example(runs, 1),
        "example2": examples.example(runs, 2),
        "table2": examples.table2(runs),
        "ladder": examples.ladder(runs),
        "claims": claims.audit(runs),
    }
    if sound:
        last = chapter(folder, quick, lambda message, share: progress(message, _PAPER + (_RUNNING - _PAPER) * share))
        results["sound"], runs = last.results, runs | last.runs
    (folder / "results.json").write_text(to_json(results, indent=1) + "\n", encoding="utf-8")
    return Reproduction(results, runs, thruster_response())
