"""The controller, ready to use: a preset of the robust composite adaptive fuzzy law, and what is chosen differently."""

from typing import Any

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.core import checks
from undertow.core.contracts import AbstractController, Model
from undertow.core.runtime import double_outside_runs

PRESETS = {"paper": double_outside_runs(paper), "robust": double_outside_runs(robust)}


def rcaf(model: Model, *, preset: str = "paper", **options: Any) -> AbstractController:
    """Robust composite adaptive fuzzy controller.

    Args:
        model: what the controller may know, from `plant.model()`.
        preset: `paper`, every default of which is Table 1, or `robust`, the sound version for real vehicles.
        options: of the preset; see `undertow.controllers.presets`.

    Raises:
        BadInput: no such preset, or a value is out of its range.
    """
    checks.choice("preset", preset, tuple(PRESETS))
    return PRESETS[preset](model, **options)


rcaf.presets = PRESETS  # pyright: ignore[reportFunctionMemberAccess] - a scenario and `describe` find their options here
