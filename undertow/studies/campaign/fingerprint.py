"""Fingerprint of a campaign: a campaign can be resumed only if nothing that affects its results has changed."""

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.scenario.provenance import text_hash, versions
from undertow.scenario.reading import parse
from undertow.studies.campaign.labels import is_number


class Identity(NamedTuple):
    """What a store records about its campaign."""

    asked: str  # the complete campaign file; requirements may change
    attributes: dict[str, str]  # must be equal in a store that is resumed

    def check_same(self, stored: Mapping[str, Any], folder: Path) -> None:
        """Check by its attributes that the store in a folder belongs to this campaign, or to one with fewer samples.

        Raises:
            BadInput: it belongs to another campaign.
        """
        differing = [key for key, value in self.attributes.items() if stored.get(key) != value]
        try:
            why = self._why(differing[0], stored) if differing else self._fewer(stored)
            why = why or ("" if isinstance(stored["chunk"], list) else "its attributes are damaged: `chunk`")
        except (KeyError, TypeError, ValueError, AttributeError, BadInput) as error:
            why = f"its attributes are damaged: {type(error).__name__}, {error}"
        if why:
            hint = "Choose another folder, or start again with --overwrite"
            must = "be the folder of the same campaign, by the same versions"
            raise BadInput("--out", must, f"another one's: {why} ({folder})", hint=hint)

    def _why(self, key: str, stored: Mapping[str, Any]) -> str:
        """The difference that an attribute indicates."""
        if key == "campaign_hash":
            return difference(_decisive(str(stored["campaign"])), _decisive(self.asked))
        if key == "scenario_hash":
            return "a file that the scenario names had other contents"
        return f"`{key}` was {stored.get(key)}, is {self.attributes[key]}"

    def _fewer(self, stored: Mapping[str, Any]) -> str:
        """A sentence where there would be fewer samples than before; otherwise empty."""
        before, now = samples(str(stored["campaign"])), samples(self.asked)
        return f"`trials` was {before}, is {now}" if now < before else ""


def identity(campaign_text: str, named: Sequence[Mapping[str, Any]]) -> Identity:
    """Fingerprint of a campaign: of its complete file, and of scenarios with the contents of all files they name.

    These files may change too.
    """
    deciding = {"campaign": _decisive(campaign_text), "scenario": _as_floats(list(named))}
    hashes = {f"{name}_hash": text_hash(json.dumps(data, sort_keys=True)) for name, data in deciding.items()}
    return Identity(campaign_text, hashes | versions())


def samples(campaign_text: str) -> int:
    """Number of samples of a campaign."""
    return _plain(campaign_text)["trials"]


def _decisive(campaign_text: str) -> dict[str, Any]:
    """The part of a campaign file that determines the rows, without bounds of metrics; 2 and 2.0 are equal.

    The number of samples is part of it only for a Latin hypercube, where every point depends on it. The order of keys
    is part of it because it determines the numbers of the trials.
    """
    required = _plain(campaign_text)["requirements"].items()
    formulas = {name: requirement["formula"] for name, requirement in required if "formula" in requirement}
    data: dict[str, Any] = {**_plain(campaign_text), "requirements": formulas}
    orders = {"vary": data["vary"], "cross": data["cross"]}
    orders |= {f"cross.{key}": entries for key, entries in data["cross"].items()}
    data |= {f"order of {name}": ", ".join(entries) for name, entries in orders.items()}
    trials = data.pop("trials")
    return _as_floats(data | ({"trials": trials} if data["design"] == "latin" else {}))


def _as_floats(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _as_floats(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_as_floats(entry) for entry in value]
    return float(value) if is_number(value) else value


# The stored file and the current one: parsing is slow for large sweeps.
@functools.lru_cache(maxsize=2)
def _plain(campaign_text: str) -> dict[str, Any]:
    return parse(campaign_text, "", Path(), file="campaign").data


def difference(before: Any, now: Any, path: str = "") -> str:
    """A sentence about the first key in which two campaigns differ."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*before, *now]):
            if before.get(key) != now.get(key):
                return difference(before.get(key), now.get(key), f"{path}.{key}".lstrip("."))
    if isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for i, (old_entry, new_entry) in enumerate(zip(before, now, strict=True)):
            if old_entry != new_entry:
                return difference(old_entry, new_entry, f"{path}[{i}]")
    return f"`{path}` was {_word(before)}, is {_word(now)}"


def _word(value: Any) -> Any:
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return "not given" if value is None else value
