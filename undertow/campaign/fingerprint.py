"""What makes a campaign the same one: only as it began may it be gone on with."""

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from undertow.campaign.labels import is_number
from undertow.core.errors import BadInput
from undertow.scenario.provenance import text_hash, versions
from undertow.scenario.reading import parse


class Identity(NamedTuple):
    """What a store knows of its campaign.

    Attributes:
        asked: everything that is asked, as a file; requirements may change.
        attributes: what must be the same in a store that is gone on with.
    """

    asked: str
    attributes: dict[str, str]

    def check_same(self, found: Mapping[str, Any], folder: Path) -> None:
        """That a store is of this campaign, or of this one with fewer draws.

        Args:
            found: attributes of the store.
            folder: that it is in, for the message.

        Raises:
            BadInput: it is of another one.
        """
        other = [key for key, value in self.attributes.items() if found.get(key) != value]
        why = self._why(other[0], found) if other else self._fewer(found)
        if why:
            hint = "Choose another folder, or begin anew with --overwrite"
            must = "be the folder of the same campaign, by the same versions"
            raise BadInput("--out", must, f"another one's: {why} ({folder})", hint=hint)

    def _why(self, key: str, found: Mapping[str, Any]) -> str:
        """What differs, of which this attribute tells that it does."""
        if key == "campaign_hash":
            return difference(_decisive(found["campaign"]), _decisive(self.asked))
        if key == "scenario_hash":
            return "a file that the scenario names had other contents"
        return f"`{key}` was {found.get(key)}, is {self.attributes[key]}"

    def _fewer(self, found: Mapping[str, Any]) -> str:
        """That there would be fewer draws than there were; nothing where there would not."""
        before, now = draws(found["campaign"]), draws(self.asked)
        return f"`trials` was {before}, is {now}" if now < before else ""


def identity(asked: str, named: Sequence[Mapping[str, Any]]) -> Identity:
    """Of a campaign.

    Args:
        asked: the whole of it as a file.
        named: scenarios in which all files that it names stand with their contents, which may change, too.
    """
    deciding = {"campaign": _decisive(asked), "scenario": _as_floats(list(named))}
    hashes = {f"{name}_hash": text_hash(json.dumps(data, sort_keys=True)) for name, data in deciding.items()}
    return Identity(asked, hashes | versions())


def draws(asked: str) -> int:
    """How many draws a campaign asks for."""
    return _plain(asked)["trials"]


def _decisive(asked: str) -> dict[str, Any]:
    """What decides about the rows; not what is required of them, and how 2 and 2.0 are told apart.

    How many there are does only in a Latin hypercube, where every point depends on it; the order of keys does where
    trials are numbered by it.
    """
    data: dict[str, Any] = {**_plain(asked), "requirements": {}}
    orders = {"vary": data["vary"], "cross": data["cross"]}
    orders |= {f"cross.{key}": entries for key, entries in data["cross"].items()}
    data |= {f"order of {name}": ", ".join(entries) for name, entries in orders.items()}
    trials = data.pop("trials")
    return _as_floats(data | ({"trials": trials} if data["design"] == "latin" else {}))


def _as_floats(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _as_floats(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_as_floats(one) for one in value]
    return float(value) if is_number(value) else value


# What stands in a store, and what is asked now: parsing takes long where much is crossed.
@functools.lru_cache(maxsize=2)
def _plain(asked: str) -> dict[str, Any]:
    return parse(asked, "", Path(), "CAMPAIGN").data


def difference(before: Any, now: Any, path: str = "") -> str:
    """The first key in which two campaigns differ, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*before, *now]):
            if before.get(key) != now.get(key):
                return difference(before.get(key), now.get(key), f"{path}.{key}".lstrip("."))
    if isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for i, (one, other) in enumerate(zip(before, now, strict=True)):
            if one != other:
                return difference(one, other, f"{path}[{i}]")
    return f"`{path}` was {_word(before)}, is {_word(now)}"


def _word(value: Any) -> Any:
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return "not given" if value is None else value
