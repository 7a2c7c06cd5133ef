"""Running many named scenarios: side by side where compilation allows, each saved so that it can be run again."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import jax

from undertow.scenario.build import Built, build
from undertow.scenario.execute import Executed, execute, save
from undertow.scenario.reading import dump

Scenarios = Mapping[str, dict[str, Any]]

# As many as compile at once: XLA compiles without Python's lock, so a second thread uses the second core.
_THREADS = 2


def run_all(scenarios: Scenarios, folder: Path, progress: Callable[[str, float], None]) -> dict[str, Executed]:
    """Run named scenarios; writes `scenarios/<name>.yaml` and `runs/<name>.nc`.

    Args:
        scenarios: name -> scenario.
        folder: where the results go.
        progress: told a message and the share done.
    """
    (folder / "scenarios").mkdir(parents=True, exist_ok=True)
    (folder / "runs").mkdir(exist_ok=True)
    for name, scenario in scenarios.items():
        (folder / "scenarios" / f"{name}.yaml").write_text(dump(scenario), encoding="utf-8")
    groups = _by_program({name: build(scenario) for name, scenario in scenarios.items()})
    found: dict[str, Executed] = {}

    def run_group(names_and_built: dict[str, Built]) -> None:
        for name, built in names_and_built.items():
            executed = execute(built)
            save(executed.dataset, folder / "runs" / f"{name}.nc")
            found[name] = executed
            progress(name, len(found) / len(scenarios))

    with ThreadPoolExecutor(_THREADS) as pool:
        for done in as_completed([pool.submit(run_group, group) for group in groups]):
            done.result()
    return found


def _by_program(built: Mapping[str, Built]) -> list[dict[str, Built]]:
    """Scenarios that compile to the same program, together: it is then compiled once. Large groups first."""
    groups: dict[Any, dict[str, Built]] = defaultdict(dict)
    for name, one in built.items():
        leaves, structure = jax.tree.flatten(one.closed_loop)
        shapes = tuple(getattr(leaf, "shape", leaf) for leaf in leaves)
        settings = one.scenario.loop
        jumps = len(one.closed_loop.disturbance.jumps(settings.duration))
        groups[structure, shapes, settings.model_dump_json(), jumps][name] = one
    return sorted(groups.values(), key=len, reverse=True)
