"""The robust composite adaptive fuzzy controller: a preset and changed options."""

from typing import Any

from undertow.control.controllers.presets.learning import learning
from undertow.control.controllers.presets.paper import paper
from undertow.control.controllers.presets.robust import robust
from undertow.core.catalogue import by_preset
from undertow.core.contracts import AbstractController, Model
from undertow.core.runtime import double_outside_runs

PRESETS = {
    "paper": double_outside_runs(paper),
    "robust": double_outside_runs(robust),
    "learning": double_outside_runs(learning),
}


def rcaf(model: Model, *, preset: str = "", **options: Any) -> AbstractController:
    """Robust composite adaptive fuzzy controller.

    Args:
        model: nominal model, from `plant.model()`.
        preset: `paper`, with the defaults of Table 1, `robust`, the robust variant for real vehicles, or
            `learning`, the same with a memory; there is no usual one.
        options: those of the preset; see `undertow.control.controllers.presets`.

    Raises:
        BadInput: no preset, or no such one or option, or a value is out of its range.
    """
    return by_preset(PRESETS, preset, model, options)


rcaf.presets = PRESETS  # pyright: ignore[reportFunctionMemberAccess] - a scenario and `describe` find their options here
