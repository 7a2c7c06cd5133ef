"""Everything of the chapter `The sound version`: the ladder again, the ablations, the conclusions."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

from undertow.reproduction.ablations import study
from undertow.reproduction.experiments import run_all
from undertow.reproduction.robust_variant import fidelity
from undertow.reproduction.robust_variant.conclusions import conclusions
from undertow.scenario.execute import Executed

Progress = Callable[[str, float], None]

# Compiling and running leave Python's lock alone most of the time: two at once use two cores.
_AT_ONCE = 2


class Chapter(NamedTuple):
    """What stands in results.json, and the runs of the fidelity."""

    results: dict[str, Any]
    runs: dict[str, Executed]


def chapter(folder: Path, quick: bool, progress: Progress) -> Chapter:
    """Run it; the scenarios of the ladder are saved as everything else that `reproduce` runs.

    Args:
        folder: where `scenarios/` and `runs/` are.
        quick: fewer fidelities, ablations and seeds.
        progress: told a message and the share done.
    """
    wanted = [module for module in study.modules() if not (quick and study.is_long(module))]
    silent = lambda message, share: None
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        runs_later = pool.submit(run_all, fidelity.scenarios(quick), folder, silent)
        later = {pool.submit(study.one, module, quick): module for module in wanted}
        try:
            for count, done in enumerate(as_completed([runs_later, *later])):
                done.result()
                what = "the ladder again" if done is runs_later else f"ablation {study.identity(later[done])}"
                progress(what, (count + 1) / (len(later) + 1))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    runs, found = runs_later.result(), [one.result() for one in later]
    rows = fidelity.table(runs, quick)
    results = {
        "quick": quick,
        "seeds": study.QUICK_SEEDS if quick else study.SEEDS,
        "left_out": [study.identity(module) for module in study.modules() if module not in wanted],
        "fidelity": rows,
        "ablations": found,
        "conclusions": conclusions(rows, found),
    }
    return Chapter(results, runs)
