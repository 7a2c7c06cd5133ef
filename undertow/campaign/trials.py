"""Trials of a campaign by their numbers: each is a scenario that `undertow simulate` could run."""

import copy
import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

from undertow.campaign.campaign_schema import VARIANT, Campaign
from undertow.campaign.labels import is_number, words
from undertow.campaign.sampling import Draws, value
from undertow.core.errors import BadInput, nearest
from undertow.scenario.reading import Text, key_path, read

# Of each combination so many trials tell whether it can be flown, and which numbers differ.
_PROBES = 4


class Trials(NamedTuple):
    """All trials, by number: every combination of `cross` with the first draw, then with the next one, and so on.

    Attributes:
        campaign: what was asked for.
        text: of the campaign file.
        scenario: what it varies, and where relative paths in it start.
        draws: points of the unit cube, for `vary`, and seeds.
        combinations: values of `cross`, one tuple per combination.
    """

    campaign: Campaign
    text: Text
    scenario: Text
    draws: Draws
    combinations: tuple[tuple[Any, ...], ...]

    @property
    def number(self) -> int:
        """How many trials there are."""
        return self.campaign.number

    def values(self, trial: int) -> dict[str, Any]:
        """What this trial puts into the scenario, by key path."""
        draw, combination = divmod(trial, len(self.combinations))
        crossed = dict(zip(self.campaign.axes, self.combinations[combination], strict=True))
        crossed |= crossed.pop(VARIANT, {}) if self.campaign.variants else {}
        drawn = zip(self.campaign.vary.items(), self.draws.point(draw), strict=True)
        return crossed | {key: value(spread, float(share)) for (key, spread), share in drawn}

    def seed(self, trial: int) -> int:
        """Of everything random in this trial."""
        return self.draws.seed(trial // len(self.combinations))

    def first(self, combination: int) -> list[int]:
        """The trials of a combination that are looked at before any is flown."""
        return [draw * len(self.combinations) + combination for draw in range(min(_PROBES, self.campaign.trials))]

    def probes(self) -> list[int]:
        """Those of all combinations."""
        return [trial for combination in range(len(self.combinations)) for trial in self.first(combination)]

    def data(self, trial: int) -> dict[str, Any]:
        """The scenario of this trial."""
        data = copy.deepcopy(self.scenario.data)
        for key, put in self.values(trial).items():
            _put(data, key, copy.deepcopy(put))
        return data | {"seed": self.seed(trial)}

    def alternatives(self) -> Iterator[dict[str, Any]]:
        """The scenario of the first trial, with each entry of what is chosen among others than numbers."""
        for key, entries in self.columns():
            for entry in (entries or {}).values():
                data = self.data(0)
                _put(data, key, copy.deepcopy(entry))
                yield data

    def place(self, name: str) -> str:
        """Line of the campaign that decides about a key of the scenario; nothing where the scenario does."""
        for section, keys in (("vary", self.campaign.vary), ("cross", self.campaign.cross)):
            for key in keys:
                if name == key or name.startswith((f"{key}.", f"{key}[")):
                    return self.text.where((section, key))
        for variant, keys in self.campaign.variants.items():
            for key in keys:
                if name == key or name.startswith((f"{key}.", f"{key}[")):
                    return self.text.where(("variants", variant, key))
        return ""

    def columns(self) -> Iterator[tuple[str, dict[str, Any] | None]]:
        """See `drawn`."""
        return drawn(self.campaign)


def drawn(campaign: Campaign) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Key paths that are drawn, with the values by name where those are not numbers."""
    for key, spread in campaign.vary.items():
        named = spread.choice is not None and not all(map(is_number, spread.choice))
        yield key, {words(entry): entry for entry in spread.choice or []} if named else None


def trials(campaign: Campaign, text: Text, allow_code: bool = False) -> Trials:
    """The trials of a campaign.

    Args:
        campaign: what is asked for.
        text: that says so.
        allow_code: whether the code that an earlier run.nc names may run, if that is its scenario.

    Raises:
        BadInput: no such scenario, or too many trials.
    """
    if campaign.number >= 2**31:
        raise BadInput("trials", "be less than 2^31 with all combinations of `cross`", campaign.number)
    combinations = tuple(itertools.product(*(entries.values() for entries in campaign.axes.values())))
    return Trials(campaign, text, _scenario(campaign, text, allow_code), Draws(campaign), combinations)


def _scenario(campaign: Campaign, text: Text, allow_code: bool) -> Text:
    given = campaign.scenario
    if isinstance(given, str):
        try:
            found = read(text.folder / given, "scenario", allow_code)
        except BadInput as error:
            raise error.at(where=error.where or text.where(("scenario",))) from error.__cause__
        if "scenario" in found.data:
            where = text.where(("scenario",))
            raise BadInput("scenario", "be the file of a scenario", f"{given}, a campaign", where=where)
        return found
    lines = {path[1:]: line for path, line in text.lines.items() if path[0] == "scenario"}
    return Text(given, text.name, text.folder, lines)


def _put(data: dict[str, Any], key: str, put: Any) -> None:
    """Set the value at a key path; a part given by its name alone becomes a mapping."""
    path = key_path(key)
    node: Any = data
    for step, following in itertools.pairwise(path):
        inner = _entry(node, step, key)
        if isinstance(inner, str):
            inner = {"kind": inner}
        elif inner is None and isinstance(following, int):
            raise _no_list(node, step, key)
        elif inner is None:
            inner = {}
        node[step] = inner
        node = inner
    _entry(node, path[-1], key)
    node[path[-1]] = put


def _no_list(node: Any, step: str | int, key: str) -> BadInput:
    """That a key path names an entry of what the scenario does not have."""
    hint = nearest(str(step), node) or f"Give `{step}` in the scenario, with all its entries"
    return BadInput(key, "name an entry of a list of the scenario", f"of `{step}`, which it does not have", hint=hint)


def _entry(node: Any, step: str | int, key: str) -> Any:
    if isinstance(node, list):
        if isinstance(step, int) and 0 <= step < len(node):
            return node[step]
        raise BadInput(key, f"name one of the {len(node)} entries, 0 to {len(node) - 1}", f"[{step}]")
    if not isinstance(node, dict):
        raise BadInput(key, "lead to a key of the scenario", f"past {node!r}")
    if isinstance(step, int):
        raise BadInput(key, "name an entry of a list only where there is a list", f"[{step}] of {', '.join(node)}")
    return node.get(step)
