"""Why trials were refused: the store has their number only, building them once more says it."""

from collections.abc import Sequence
from typing import NamedTuple

from undertow.campaign.task import build_trial
from undertow.campaign.trials import Trials
from undertow.core.errors import BadInput
from undertow.scenario.part_cache import PartCache

# Trials that are looked at: building one takes milliseconds.
_MOST = 200


class Refusal(NamedTuple):
    """Trials that were refused for the same reason."""

    why: str  # with the numbers of the first of them
    trials: int


def refusals(several: Trials, rows: Sequence[int]) -> tuple[Refusal, ...]:
    """Reasons, the most frequent first.

    Args:
        several: the trials.
        rows: numbers of those that were refused; only the first 200 are looked at.
    """
    part_cache, found = PartCache(), dict[tuple[str, str], list[str]]()
    for row in rows[:_MOST]:
        try:
            build_trial(several, part_cache, int(row))
        except BadInput as error:
            found.setdefault((error.name, error.must), []).append(str(error))
    return tuple(Refusal(each[0], len(each)) for each in sorted(found.values(), key=len, reverse=True))
