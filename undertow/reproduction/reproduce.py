"""`undertow reproduce`: every figure and table of the paper, and the audit of its claims."""

from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from undertow.reproduction import claims, drifting, examples, horizons, lag_map
from undertow.reproduction.robust_variant.chapter import chapter
from undertow.reproduction.running import Progress, run_all, start, two_at_once, write_all
from undertow.reproduction.setup import CONTROLLERS
from undertow.reproduction.thruster_response import ThrusterResponse, thruster_response
from undertow.scenario.execute import Executed
from undertow.scenario.finished_run import to_json
from undertow.scenario.provenance import versions

# Share of the work that the paper's runs take, with the long horizon, and with the last chapter; the rest is plotting.
_PAPER, _LONG, _RUNNING = 0.25, 0.35, 0.9


class Reproduction(NamedTuple):
    """Results of `undertow reproduce` before they are plotted."""

    results: dict[str, Any]  # contents of results.json
    runs: dict[str, Executed]
    response: ThrusterResponse

    def datasets(self, fidelity: str) -> dict[str, xr.Dataset]:
        """Recorded series at a fidelity level, by controller. Examples 1 and 2 are `ideal` and `static`."""
        return {name: self.runs[f"{fidelity}_{name}"].dataset for name in CONTROLLERS}


def reproduce(folder: Path, quick: bool, progress: Progress) -> Reproduction:
    """Run the paper and audit it; writes `runs/`, `scenarios/` and `results.json` into a folder.

    Args:
        folder: an existing, empty folder.
        quick: fewer points in the sweeps and a long horizon of 200 s, not 2,000 s; the same accuracy.
        progress: called with a message and the share done.
    """
    named = examples.scenarios() | claims.scenarios(quick)
    batched = horizons.scenarios(quick) | lag_map.scenarios(quick) | claims.batched(quick)
    write_all(batched, folder)
    with two_at_once() as pool:
        running_batches = start(batched, horizons.windows(quick), 1.0, ("weights_peak",), pool)
        runs = run_all(named, folder, lambda message, share: progress(message, _PAPER * share))
        progress(f"{horizons.duration(quick):g} s at every fidelity level", _PAPER)
        long = running_batches()
    progress("evaluating the claims", _LONG)
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
        "drifting": drifting.shown(folder),
        "claims": claims.audit(runs, long),
    }
    report = lambda message, share: progress(message, _LONG + (_RUNNING - _LONG) * share)
    results["robust_variant"], more = chapter(folder, quick, report)
    (folder / "results.json").write_text(to_json(results, indent=1) + "\n", encoding="utf-8")
    return Reproduction(results, runs | more, thruster_response())
