"""Gains of a law for every vehicle of the arena, tuned with an equal number of evaluations on a task of its own."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.scenario.reading import from_data
from undertow.studies.arena.tasks import training_keys
from undertow.studies.comparison.candidates import Candidate
from undertow.studies.comparison.equal_budgets import equal_budgets


class TunedGains(NamedTuple):
    """Gains of a law.

    Attributes:
        options: vehicle -> options of the controller; empty for a law that was not tuned on it.
        sentences: vehicle -> how the gains came about.
    """

    options: dict[str, dict[str, Any]]
    sentences: dict[str, str]


def controller_of(law: Candidate, vehicle: str, gains: TunedGains | None) -> dict[str, Any]:
    """Part `controller` of a law on a vehicle, with its tuned gains if there are any."""
    return law.changes["controller"] | ({} if gains is None else gains.options.get(vehicle, {}))


def tuned_gains(
    law: Candidate, vehicles: Sequence[str], budget: int, folder: Path, say: Callable[[str], None]
) -> TunedGains:
    """Tune a law for every vehicle on a motion in waves, with seeds, seas and parameter sets that no task has.

    Args:
        law: the law.
        vehicles: names.
        budget: evaluations for each vehicle.
        folder: for finished tunings and checkpoints; what is there is used.
        say: called with the current stage.

    Raises:
        BadInput: the law cannot be built, or the folder is of another tuning.
    """
    options, sentences = {}, {}
    for vehicle in vehicles:
        scenario = from_data(training_keys(vehicle) | {"controller": law.changes["controller"]})
        stage = lambda words, vehicle=vehicle: say(f"{vehicle}: {words}")
        _, budgets = equal_budgets([law], scenario, budget, folder / vehicle, stage)
        options[vehicle] = budgets.laws[0].gains
        sentences[vehicle] = budgets.laws[0].sentence
    return TunedGains(options, sentences)
