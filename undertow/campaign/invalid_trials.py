"""Why trials are invalid: the store has only their numbers, so a few of them are built again to get the error."""

from collections.abc import Sequence
from typing import NamedTuple

from undertow.campaign.task import build_trial
from undertow.campaign.trials import Trials
from undertow.core.errors import BadInput
from undertow.scenario.part_cache import PartCache

# Trials that are built again: each takes milliseconds.
_MOST = 200


class InvalidTrials(NamedTuple):
    """Trials that are invalid for the same reason."""

    why: str  # the error of the first of them
    trials: int


def reasons(several: Trials, rows: Sequence[int]) -> tuple[InvalidTrials, ...]:
    """The reasons why trials are invalid, the most frequent first.

    Args:
        several: the trials.
        rows: numbers of the invalid trials; only the first 200 are built again.
    """
    part_cache, found = PartCache(), dict[tuple[str, str], list[str]]()
    for row in rows[:_MOST]:
        try:
            build_trial(several, part_cache, int(row))
        except BadInput as error:
            found.setdefault((error.name, error.must), []).append(str(error))
    return tuple(InvalidTrials(each[0], len(each)) for each in sorted(found.values(), key=len, reverse=True))
