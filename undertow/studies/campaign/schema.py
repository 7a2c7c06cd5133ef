"""What a campaign file may say."""

import re
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from undertow.core.errors import BadInput
from undertow.scenario.reading import Text
from undertow.scenario.schema import Scenario, Strict, complaint

_PATH = re.compile(r"[\w-]+(\.[\w-]+|\[\d+\])*")

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


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
    share: float = Field(0.95, gt=0, le=1, description="in this share of the trials at least")


class Series(Strict):
    """Signals that are kept of every trial."""

    signals: list[str] = Field(
        ["position", "error"], min_length=1, description="names, see `undertow describe metrics`"
    )
    every: float = Field(1.0, gt=0, description="time between records, s")


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
    requirements: dict[str, Requirement] = Field(default_factory=dict, description="metric -> what it must keep to")
    series: Series | None = Field(None, description="signals to keep; metrics only unless given")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="of all draws and of the seeds of the trials")
    chunk: int = Field(256, ge=1, le=100_000, description="trials per task; no result depends on it")

    @field_validator("cross", mode="before")
    @classmethod
    def _named(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        return {key: _by_name(values) if isinstance(values, list) else values for key, values in given.items()}


def _by_name(values: list[Any]) -> dict[str, Any]:
    """Values under names of their own: a part's kind and preset, else the value itself."""
    names = [_name(value) for value in values]
    alone = lambda name: names.count(name) == 1
    unique = [name if alone(name) else f"{name} {i + 1}" for i, name in enumerate(names)]
    return dict(zip(unique, values, strict=True))


def _name(value: Any) -> str:
    if isinstance(value, dict) and "kind" in value:
        return " ".join(str(value[key]) for key in ("kind", "preset") if key in value)
    return str(value)


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
    for section, keys in (("vary", found.vary), ("cross", found.cross)):
        for key in keys:
            if not _PATH.fullmatch(key):
                must = "be a key path such as plant.vehicle.mass or initial.position[0]"
                raise BadInput(section, must, repr(key), where=text.where((section, key)))
    every = [(section, key) for section, keys in (("vary", found.vary), ("cross", found.cross)) for key in keys]
    for section, key in every:
        if key == "seed":
            hint = "Every trial has one of its own; `seed` of the campaign decides which"
            raise BadInput(f"{section}.seed", "be left out", hint=hint, where=text.where((section, key)))
        for _, other in every:
            if other.startswith((f"{key}.", f"{key}[")):
                must = f"not be beside {key}, which it is a part of"
                raise BadInput(other, must, where=text.where((section, key)))
    for key in found.cross:
        if not found.cross[key]:
            raise BadInput(f"cross.{key}", "have an entry", where=text.where(("cross", key)))
        if key in found.vary:
            raise BadInput(f"cross.{key}", "not be in `vary`, too", where=text.where(("cross", key)))
    return found
