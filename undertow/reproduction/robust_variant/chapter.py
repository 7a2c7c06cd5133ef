"""The chapter `The robust variant`: every fidelity level, the ablations, the conclusions."""

from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

from undertow.reproduction.ablations import study
from undertow.reproduction.ablations.verdicts import ABLATIONS
from undertow.reproduction.robust_variant import fidelity
from undertow.reproduction.robust_variant.conclusions import conclusions
from undertow.reproduction.running import Progress, run_all, two_at_once
from undertow.scenario.execute import Executed


def chapter(folder: Path, quick: bool, progress: Progress) -> tuple[dict[str, Any], dict[str, Executed]]:
    """Run the chapter; scenarios and campaigns are saved as all others of `reproduce`.

    Args:
        folder: folder of `scenarios/` and `runs/`.
        quick: fewer fidelity levels, ablations and seeds.
        progress: called with a message and the share done.

    Returns:
        Entries of results.json, and the runs of the fidelity comparison.
    """
    selected = [one for one in ABLATIONS if not (quick and one.long)]
    silent = lambda message, share: None
    with two_at_once() as pool:
        runs_later = pool.submit(run_all, fidelity.scenarios(quick), folder, silent)
        later = {pool.submit(study.run, one, quick, folder): one for one in selected}
        for count, done in enumerate(as_completed([runs_later, *later])):
            done.result()
            what = "every fidelity level, sampled" if done is runs_later else f"ablation {later[done].id}"
            progress(what, (count + 1) / (len(later) + 1))
    runs, found = runs_later.result(), [one.result() for one in later]
    rows = fidelity.table(runs, quick)
    results = {
        "quick": quick,
        "seeds": found[0]["variants"][0]["seeds"],
        "left_out": [one.id for one in ABLATIONS if one not in selected],
        "fidelity": rows,
        "ablations": found,
        "conclusions": conclusions(rows, found),
    }
    return results, runs
