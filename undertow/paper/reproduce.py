"""`undertow reproduce`: every figure and table of the paper, and the audit of its claims."""

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from undertow.core.atomic_io import write_whole
from undertow.core.json_text import to_json
from undertow.paper import claims, drift_study, examples, horizons, lag_map
from undertow.paper.robust_variant import chapter
from undertow.paper.running import start_all, start_batches, write_all
from undertow.paper.setup import CONTROLLERS
from undertow.paper.thruster_response import ThrusterResponse, thruster_response
from undertow.scenario.provenance import versions
from undertow.scenario.results.run_result import ScenarioResult
from undertow.simulation.processes import Tasks

_RUNNING = 0.9  # share of the work that the runs take; the rest is plotting


class Reproduction(NamedTuple):
    """Results of `undertow reproduce` before they are plotted."""

    results: dict[str, Any]  # contents of results.json
    runs: dict[str, ScenarioResult]
    response: ThrusterResponse

    def datasets(self, fidelity: str) -> dict[str, xr.Dataset]:
        """Recorded series at a fidelity level, by controller. Examples 1 and 2 are `ideal` and `static`."""
        return {name: self.runs[f"{fidelity}_{name}"].dataset for name in CONTROLLERS}


def reproduce(folder: Path, quick: bool, progress: Callable[[str, float], None], pool: Executor) -> Reproduction:
    """Run the paper and audit it; writes `runs/`, `scenarios/` and `results.json` into a folder.

    Args:
        folder: an existing, empty folder.
        quick: fewer points in the sweeps and a long horizon of 200 s, not 2,000 s; the same accuracy.
        progress: called with a message and the share done.
        pool: executor of `worker_processes`; nothing waits before all that can be run has begun.
    """
    tasks = Tasks(pool, lambda words, share: progress(words, _RUNNING * share))
    named = examples.scenarios() | claims.scenarios(quick)
    batched = horizons.scenarios(quick) | lag_map.scenarios(quick) | claims.batched(quick)
    write_all(batched, folder)
    of_paper = start_all(named, folder, tasks)
    of_batches = start_batches(batched, horizons.windows(quick), 1.0, ("weights_peak",), tasks)
    of_drift, of_chapter = drift_study.start_runs(folder, tasks), chapter.start_chapter(folder, quick, tasks)
    runs, long = of_paper(), of_batches()
    results = {
        "provenance": {"quick": quick, "scenarios": sorted(named | batched), **versions()},
        "example1": examples.example(runs, 1),
        "example2": examples.example(runs, 2),
        "table2": examples.table2(runs),
        "fidelity": examples.fidelity(runs),
        "horizons": {
            "duration": horizons.duration(quick),
            "windows": horizons.windows(quick),
            "rows": horizons.table(long, quick),
        },
        "lags": lag_map.table(long, quick),
        "drifting": drift_study.drift_results(of_drift()),
        "claims": claims.audit(runs, long),
    }
    results["robust_variant"], chapter_runs = of_chapter()
    write_whole(folder / "results.json", to_json(results, indent=1) + "\n")
    return Reproduction(results, runs | chapter_runs, thruster_response())
