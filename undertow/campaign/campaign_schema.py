"""What a campaign file may say."""

import math
import re
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from undertow.campaign.labels import by_name, words
from undertow.core.errors import BadInput
from undertow.scenario.reading import Text
from undertow.scenario.schema import Scenario, Strict, complaint

# Entries of lists in brackets only: each key has one spelling, so that two that name it are noticed.
_PATH = re.compile(r"[a-zA-Z_][\w-]*(\.[a-zA-Z_][\w-]*|\[\d+\])*")

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


VARIANT = "variant"  # the axis of `variants`, beside those of `cross`


class Spread(Strict):
    """How one parameter is drawn: exactly one of these."""

    uniform: Pair | None = Field(None, description="low, high")
    log_uniform: Pair | None = Field(None, description="low, high, both positive")
    normal: Pair | None = Field(None, description="mean, standard deviation")
    choice: list[Any] | None = Field(None, min_length=1, description="one of these, equally likely")

    @model_validator(mode="after")
    def _one(self) -> "Spread":
        given = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("have one of uniform, log_uniform, normal, choice")
        pair = getattr(self, given[0])
        if given[0] in ("uniform", "log_uniform") and not pair[0] < pair[1]:
            raise ValueError("have low below high")
        if given[0] == "log_uniform" and not pair[0] > 0:
            raise ValueError("have positive bounds")
        if given[0] == "normal" and not pair[1] >= 0:
            raise ValueError("have a standard deviation that is not negative")
        return self


class Requirement(Strict):
    """What a metric must keep to in a share of all trials."""

    below: float = Field(description="the metric must be smaller")
    share: float = Field(0.95, gt=0, description="in this share of the trials at least")

    @field_validator("share")
    @classmethod
    def _provable(cls, given: float) -> float:
        if given >= 1:
            raise ValueError("be less than 1, as no number of trials shows that all keep to it; 0.99, for example")
        return given


class Series(Strict):
    """Signals that are kept of every trial."""

    signals: list[str] = Field(
        ["position", "error"],
        min_length=1,
        description="names of variables of run.nc, as `undertow simulate` writes them",
    )
    every: float = Field(1.0, gt=0, description="time between records, s")

    @field_validator("signals")
    @classmethod
    def _once(cls, given: list[str]) -> list[str]:
        if len(set(given)) < len(given):
            raise ValueError("name every signal once")
        return given


class Campaign(Strict):
    """One campaign: a scenario, and what varies from trial to trial."""

    description: str = Field("", description="free text")
    scenario: str | dict[str, Any] = Field(description="file of the scenario, or the scenario itself")
    trials: int = Field(1000, ge=1, le=10**9, description="number of draws")
    design: Literal["random", "latin", "sobol"] = Field("random", description="how draws fill the space of `vary`")
    vary: dict[str, Spread] = Field(default_factory=dict, description="key path of the scenario -> how it is drawn")
    cross: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="key path -> values, a list or by names; all fly the same draws and seeds"
    )
    variants: dict[str, dict[str, Any]] = Field(
        default_factory=dict,
        description="name -> key paths and their values: whatever changes together; an axis after those of `cross`",
    )
    requirements: dict[str, Requirement] = Field(default_factory=dict, description="metric -> what it must keep to")
    series: Series | None = Field(None, description="signals to keep; metrics only unless given")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="of all draws and of the seeds of the trials")
    chunk: int = Field(256, ge=1, le=100_000, description="trials per task; no result depends on it")

    @field_validator("scenario", mode="before")
    @classmethod
    def _file_or_mapping(cls, given: Any) -> Any:
        if not isinstance(given, str | dict):
            raise ValueError("be the name of a file, or a mapping of keys to values")
        return given

    @field_validator("cross", mode="before")
    @classmethod
    def _named(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        for key, values in given.items():
            if not isinstance(values, list | dict):
                raise ValueError(f"have a list of values for `{key}`, or values by names")
        return {key: by_name(values) if isinstance(values, list) else values for key, values in given.items()}

    @property
    def axes(self) -> dict[str, dict[str, Any]]:
        """Values by names along every axis: the key paths of `cross`, then `variant`."""
        return self.cross | ({VARIANT: self.variants} if self.variants else {})

    @property
    def keys(self) -> list[str]:
        """Every key path whose value is not that of the scenario in all trials."""
        return [*self.vary, *self.cross, *(key for variant in self.variants.values() for key in variant)]

    @property
    def number(self) -> int:
        """Trials all told: the draws, for every combination of `cross` and `variants`."""
        return math.prod(len(entries) for entries in self.axes.values()) * self.trials


def validate(text: Text) -> Campaign:
    """The campaign, or the first complaint about it.

    Raises:
        BadInput: unknown key, wrong type, value out of range.
    """
    if "scenario" not in text.data and set(text.data) & set(Scenario.model_fields) - set(Campaign.model_fields):
        hint = f"`undertow simulate` runs it; a campaign has it under `scenario: {text.name or '...'}`"
        raise BadInput("CAMPAIGN", "be a campaign", "a scenario", hint=hint, where=text.name)
    try:
        found = Campaign.model_validate(text.data)
    except ValidationError as errors:
        raise complaint(errors, text, Campaign) from None
    pairs = [(section, key) for section in ("vary", "cross") for key in getattr(found, section)]
    for section, key in pairs:
        _check_key(section, key, [other for _, other in pairs], text.where((section, key)))
    if found.variants and VARIANT in found.cross:
        raise BadInput(f"cross.{VARIANT}", "be left out beside `variants`", where=text.where(("cross", VARIANT)))
    for name, variant in found.variants.items():
        for key in variant:
            _check_key("variants", key, [*found.vary, key], text.where(("variants", name, key)))
    for key, entries in found.cross.items():
        _check_entries(key, entries, text.where(("cross", key)))
    return found


def _check_key(section: str, key: str, every: list[str], where: str) -> None:
    """A key path of `vary` or `cross`."""
    if not _PATH.fullmatch(key):
        must = "be a key path such as plant.vehicle.mass or initial.position[0]"
        raise BadInput(section, must, repr(key), where=where)
    if key.startswith("scenario."):
        raise BadInput(key, "start inside the scenario", hint=f"Write `{key.removeprefix('scenario.')}`", where=where)
    if key == "seed":
        hint = "Every trial has one of its own; `seed` of the campaign decides which"
        raise BadInput(f"{section}.seed", "be left out", hint=hint, where=where)
    if every.count(key) > 1:
        raise BadInput(f"{section if section == 'variants' else 'cross'}.{key}", "not be in `vary`, too", where=where)
    for other in every:
        if other.startswith((f"{key}.", f"{key}[")):
            raise BadInput(other, f"not be beside {key}, which it is a part of", where=where)


def _check_entries(key: str, entries: dict[str, Any], where: str) -> None:
    """The values of one key of `cross`."""
    name = f"cross.{key}"
    if not entries:
        raise BadInput(name, "have an entry", where=where)
    if set(entries) <= set(Spread.model_fields):
        hint = f"`vary` draws; here, write `{key}: [first, second]`, or names and values"
        raise BadInput(name, "be a list, or values by names", f"{next(iter(entries))} alone", hint=hint, where=where)
    known: dict[str, str] = {}
    for word, entry in entries.items():
        same = known.setdefault(repr(float(entry) if isinstance(entry, int) else entry), word)
        if same != word:
            raise BadInput(name, "have entries that differ", f"twice {words(entry)}", where=where)
