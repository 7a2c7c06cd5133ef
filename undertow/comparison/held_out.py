"""Conditions that tuned controllers are judged in: other seeds, other parameter sets of the vehicle, other seas."""

from collections.abc import Sequence
from typing import Any

from undertow.comparison.candidates import Candidate
from undertow.comparison.equal_budgets import EqualBudgets
from undertow.scenario.build import build
from undertow.scenario.reading import Text

SET = "plant.vehicle.parameters"
_WAVES, _HEIGHT = "waves", "height"


def held_out(
    text: Text, scenario: Text, candidates: Sequence[Candidate], budgets: EqualBudgets
) -> tuple[Text, list[Candidate]]:
    """The comparison on held-out conditions.

    The seeds of the trials are those of the campaign, which no training run has. The parameter set of the plant is one
    of the held-out sets while the nominal model keeps the vehicle of the scenario, and wave heights are between the
    smallest and the largest held-out size. A key that the user varies, or a nominal model that the user gives, stays.

    Args:
        text: the scenario, or a campaign file that has it.
        scenario: the scenario.
        candidates: tuned controllers.
        budgets: how they were tuned.

    Returns:
        The campaign file, and the candidates with the nominal model.
    """
    if budgets.held_out is None:
        return text, list(candidates)
    data = dict(text.data) if "scenario" in text.data else {"scenario": text.data}
    asked, vary = data.get("vary") or {}, {}
    resolved = build(scenario).resolved
    changes: dict[str, Any] = {}
    sets = budgets.held_out.sets
    if len(sets) > 1 and not any(key.startswith("plant.vehicle") or key == "plant" for key in asked):
        vary[SET] = {"choice": list(sets)}
        if resolved["model"].get("vehicle") is None:
            changes["model.vehicle"] = resolved["plant"]["vehicle"]
    low, high = min(budgets.held_out.sizes), max(budgets.held_out.sizes)
    for key, height in _heights(scenario.data.get("disturbance"), resolved["disturbance"]).items():
        if low < high and height > 0 and not any(key.startswith(other) for other in asked):
            vary[key] = {"uniform": [low * height, high * height]}
    lines = text.lines if "scenario" in text.data else {("scenario", *place): one for place, one in text.lines.items()}
    text = text._replace(data=data | {"vary": {**asked, **vary}}, lines=lines)
    return text, [one._replace(changes=one.changes | changes) for one in candidates]


def _heights(written: Any, resolved: Any) -> dict[str, float]:
    """Key path -> wave height, m, of every disturbance with waves."""
    listed = isinstance(written, list)
    entries = resolved if isinstance(resolved, list) else [resolved]
    place = lambda number: f"disturbance[{number}]" if listed else "disturbance"
    return {
        f"{place(number)}.{_HEIGHT}": float(one[_HEIGHT])
        for number, one in enumerate(entries)
        if one.get("kind") == _WAVES and isinstance(one.get(_HEIGHT), int | float)
    }
