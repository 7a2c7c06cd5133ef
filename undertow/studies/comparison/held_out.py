"""Conditions that tuned controllers are judged in: other seeds, other parameter sets of the vehicle, other seas."""

from typing import Any

from undertow.scenario.build import build
from undertow.scenario.reading import Text
from undertow.studies.comparison.equal_budgets import EqualBudgets

SET = "plant.vehicle.parameters"
_WAVES, _HEIGHT = "waves", "height"


def held_out(text: Text, scenario: Text, budgets: EqualBudgets) -> Text:
    """The campaign file of a comparison on held-out conditions.

    The seeds of the trials are those of the campaign, which no training run has. The parameter set of the plant is one
    of the held-out sets, of which the nominal model knows nothing, and wave heights are between the smallest and the
    largest held-out size. A key that the user varies stays.

    Args:
        text: the scenario, or a campaign file that has it.
        scenario: the scenario.
        budgets: how its controllers were tuned.
    """
    if budgets.held_out is None:
        return text
    data = dict(text.data) if "scenario" in text.data else {"scenario": text.data}
    user_vary = data.get("vary") or {}
    vary = {}
    resolved = build(scenario).resolved
    sets = budgets.held_out.sets
    if len(sets) > 1 and not any(key.startswith("plant.vehicle") or key == "plant" for key in user_vary):
        vary[SET] = {"choice": list(sets)}
    low, high = min(budgets.held_out.sizes), max(budgets.held_out.sizes)
    for key, height in _heights(scenario.data.get("disturbance"), resolved["disturbance"]).items():
        if low < high and height > 0 and not any(key.startswith(user_key) for user_key in user_vary):
            vary[key] = {"uniform": [low * height, high * height]}
    lines = text.lines
    if "scenario" not in text.data:
        lines = {("scenario", *key_path): line for key_path, line in lines.items()}
    return text._replace(data=data | {"vary": {**user_vary, **vary}}, lines=lines)


def _heights(as_written: Any, resolved: Any) -> dict[str, float]:
    """Key path -> wave height, m, of every disturbance with waves."""
    listed = isinstance(as_written, list)
    entries = resolved if isinstance(resolved, list) else [resolved]
    location = lambda number: f"disturbance[{number}]" if listed else "disturbance"
    return {
        f"{location(number)}.{_HEIGHT}": float(entry[_HEIGHT])
        for number, entry in enumerate(entries)
        if entry.get("kind") == _WAVES and isinstance(entry.get(_HEIGHT), int | float)
    }
