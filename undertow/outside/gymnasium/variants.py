"""Domain randomisation: closed loops of a scenario whose numbers are sampled as in a campaign."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.core.contracts import Outputs
from undertow.core.errors import BadInput
from undertow.scenario.build import Built
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import Text
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import structure
from undertow.studies.campaign.build_trials import build_data
from undertow.studies.campaign.campaign_schema import validate
from undertow.studies.campaign.trials import trials

Vary = Mapping[str, Mapping[str, Any]]
Variant = tuple[ClosedLoop, tuple[Outputs, Outputs]]


def variants_of(built: Built, vary: Vary, count: int) -> tuple[list[Variant], list[bool]]:
    """Loops and starts with sampled values; and which of their arrays are equal in all, in the order of the leaves.

    Args:
        built: the scenario.
        vary: key path -> distribution, as `vary` of a campaign.
        count: how many, where anything varies.

    Raises:
        BadInput: a distribution or a key is wrong, or the loops differ in more than numbers.
    """
    if not vary:
        variants = [_variant(built)]
    else:
        data = {"scenario": dict(built.text.data), "vary": dict(vary), "trials": count}
        text = Text(data, "", built.text.folder, {})
        campaign_trials = trials(validate(text), text)
        cache = PartCache()
        variants = [
            _variant(build_data(campaign_trials, cache, campaign_trials.data(number))) for number in range(count)
        ]
    if len(set(map(structure, variants))) > 1:
        raise BadInput("vary", "change numbers only", "such that the loops have different parts")
    leaves = [jax.tree.leaves(eqx.filter(variant, eqx.is_array)) for variant in variants]
    return variants, [all(np.array_equal(column[0], array) for array in column) for column in zip(*leaves, strict=True)]


def _variant(built: Built) -> Variant:
    initial = built.scenario.initial
    return built.closed_loop, built.closed_loop.outputs_at_start(initial.position, initial.velocity)
