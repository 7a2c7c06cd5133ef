"""Running many named scenarios, each saved so that it can be run again."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from undertow.scenario.execute import Executed, execute, save
from undertow.scenario.reading import dump

Scenarios = Mapping[str, dict[str, Any]]


def run_all(scenarios: Scenarios, folder: Path, progress: Callable[[str, float], None]) -> dict[str, Executed]:
    """Run named scenarios; writes `scenarios/<name>.yaml` and `runs/<name>.nc`.

    Args:
        scenarios: name -> scenario.
        folder: where the results go.
        progress: told a message and the share done.
    """
    write_all(scenarios, folder)
    (folder / "runs").mkdir(exist_ok=True)
    found = {}
    for name, scenario in scenarios.items():
        progress(f"running {name}", len(found) / len(scenarios))
        found[name] = execute(scenario)
        save(found[name].dataset, folder / "runs" / f"{name}.nc")
    return found


def write_all(scenarios: Scenarios, folder: Path) -> None:
    """Write `scenarios/<name>.yaml`, for those who want to run them again."""
    (folder / "scenarios").mkdir(parents=True, exist_ok=True)
    for name, scenario in scenarios.items():
        (folder / "scenarios" / f"{name}.yaml").write_text(dump(scenario), encoding="utf-8")
