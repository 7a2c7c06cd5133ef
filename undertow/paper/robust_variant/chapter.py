"""The chapter `The robust variant`: every fidelity level, the ablations, the conclusions."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from undertow.paper.ablations import study
from undertow.paper.ablations.verdicts import ABLATIONS
from undertow.paper.robust_variant import fidelity
from undertow.paper.robust_variant.conclusions import conclusions
from undertow.paper.running import start_all
from undertow.scenario.results.run_result import ScenarioResult
from undertow.simulation.processes import Tasks

Chapter = tuple[dict[str, Any], dict[str, ScenarioResult]]


def start_chapter(folder: Path, quick: bool, tasks: Tasks) -> Callable[[], Chapter]:
    """Begin to run the chapter; scenarios and campaigns are saved as all others of `reproduce`.

    Args:
        folder: folder of `scenarios/` and `runs/`.
        quick: fewer fidelity levels, ablations and seeds.
        tasks: where the runs and the ablations are tasks.

    Returns:
        Function that waits for the entries of results.json, and the runs of the fidelity comparison.
    """
    selected = [entry for entry in ABLATIONS if not (quick and entry.long)]
    compared = start_all(fidelity.scenarios(quick), folder, tasks)
    # The longest begin first, so that no process waits for the last one.
    order = sorted(selected, key=study.trials_of, reverse=True)
    ablation_tasks = {
        entry.id: tasks.submit(f"ablation {entry.id}", ablation, entry.id, quick, folder) for entry in order
    }

    def finished() -> Chapter:
        runs = compared()
        ablation_rows = [ablation_tasks[entry.id].result() for entry in selected]
        rows = fidelity.table(runs, quick)
        results = {
            "quick": quick,
            "seeds": ablation_rows[0]["variants"][0]["seeds"],
            "left_out": [entry.id for entry in ABLATIONS if entry not in selected],
            "fidelity": rows,
            "ablations": ablation_rows,
            "conclusions": conclusions(rows, ablation_rows),
        }
        return results, runs

    return finished


def ablation(name: str, quick: bool, folder: Path) -> dict[str, Any]:
    """The ablation of an id, run."""
    return study.run(next(entry for entry in ABLATIONS if entry.id == name), quick, folder)
