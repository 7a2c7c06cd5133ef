"""What makes a campaign the same one: only as it began may it be gone on with."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.scenario.build import Built
from undertow.scenario.provenance import text_hash, versions
from undertow.scenario.reading import dump
from undertow.studies.campaign.reading import decisive, plain
from undertow.studies.campaign.trials import Trials


class Identity(NamedTuple):
    """What a store knows of its campaign.

    Attributes:
        asked: everything that is asked, as a file; requirements may change.
        attributes: what must be the same in a store that is gone on with.
    """

    asked: str
    attributes: dict[str, str]

    def check_same(self, found: Mapping[str, Any], folder: Path) -> None:
        """That a store is of this campaign.

        Args:
            found: attributes of the store.
            folder: that it is in, for the message.

        Raises:
            BadInput: it is of another one.
        """
        other = [key for key, value in self.attributes.items() if found.get(key) != value]
        if not other:
            return
        got = f"another one's: {self._why(other[0], found)} ({folder})"
        hint = "Choose another folder, or begin anew with --overwrite"
        raise BadInput("--out", "be the folder of the same campaign, by the same versions", got, hint=hint)

    def _why(self, key: str, found: Mapping[str, Any]) -> str:
        """What differs, of which this attribute tells that it does."""
        if key == "campaign_hash":
            return difference(plain(found["campaign"]), plain(self.asked))
        if key == "scenario_hash":
            return "a file that the scenario names had other contents"
        return f"`{key}` was {found.get(key)}, is {self.attributes[key]}"


def identity(several: Trials, asked: str, first: Built) -> Identity:
    """Of a campaign.

    Args:
        several: its trials.
        asked: the whole of it as a file.
        first: one of its trials; it has the contents of files that the scenario names, which may change, too.
    """
    texts = {"campaign": decisive(several.campaign, several.scenario.data), "scenario": dump(first.resolved)}
    return Identity(asked, {f"{name}_hash": text_hash(text) for name, text in texts.items()} | versions())


def difference(before: Any, now: Any, path: str = "") -> str:
    """The first key in which two campaigns differ, in words; requirements do not count."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*before, *now]):
            if before.get(key) != now.get(key) and (path or key != "requirements"):
                return difference(before.get(key), now.get(key), f"{path}.{key}".lstrip("."))
    if isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for i, (one, other) in enumerate(zip(before, now, strict=True)):
            if one != other:
                return difference(one, other, f"{path}[{i}]")
    word = lambda value: "not given" if value is None else value
    return f"`{path}` was {word(before)}, is {word(now)}"
