"""Keys of a campaign file, their defaults and their checks."""

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from undertow.core.errors import BadInput, error_location, nearest
from undertow.scenario.correlation import correlation_matrix
from undertow.scenario.json_schema import scenario_schema
from undertow.scenario.reading import Text, dump, key_path, parse, read
from undertow.scenario.schema import RunRequirement, Scenario, Strict
from undertow.scenario.validation import complaint, kind_of
from undertow.studies.campaign.labels import by_name, words

# List entries in brackets only: each key has one spelling, so that duplicates are noticed.
_PATH = re.compile(r"[a-zA-Z_][\w-]*(\.[a-zA-Z_][\w-]*|\[\d+\])*")

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Triple = Annotated[list[float], Field(min_length=3, max_length=3)]


# Trials of the smallest and the largest task, unless `chunk` is given.
_SMALL, _LARGE = 256, 4096

VARIANT = "variant"  # the axis of `variants`, beside those of `cross`


class Distribution(Strict):
    """Distribution of one parameter: exactly one of these keys."""

    uniform: Pair | None = Field(None, description="low, high")
    log_uniform: Pair | None = Field(None, description="low, high, both positive")
    normal: Pair | None = Field(None, description="mean, standard deviation")
    choice: list[Any] | None = Field(None, min_length=1, description="one of these values, equally likely")
    log_normal: Pair | None = Field(
        None, description="median, which is positive, and standard deviation of the logarithm"
    )
    cut_normal: Triple | None = Field(
        None, description="mean, standard deviation, and least value, which replaces smaller ones"
    )
    deviations: Literal["file"] | None = Field(
        None,
        description="of `plant.vehicle`: all parameters that have a deviation in the vehicle file, with correlations",
    )

    @model_validator(mode="before")
    @classmethod
    def _by_its_name(cls, value: Any) -> Any:
        if not isinstance(value, dict) or {"distribution", "kind", "type"} & set(value):
            low, high = value if isinstance(value, list) and len(value) == 2 else ("low", "high")
            raise ValueError(f"be a distribution with its numbers, such as {{uniform: [{low}, {high}]}}")
        return value

    @model_validator(mode="after")
    def _one(self) -> "Distribution":
        distribution_names = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(distribution_names) != 1:
            raise ValueError(f"have one of {', '.join(type(self).model_fields)}")
        pair = getattr(self, distribution_names[0])
        if distribution_names[0] in ("uniform", "log_uniform") and not pair[0] < pair[1]:
            raise ValueError("have low below high")
        if distribution_names[0] == "log_uniform" and not pair[0] > 0:
            raise ValueError("have positive bounds")
        if distribution_names[0] == "log_normal" and not pair[0] > 0:
            raise ValueError("have a positive median")
        if distribution_names[0] in ("normal", "log_normal", "cut_normal") and not pair[1] >= 0:
            raise ValueError("have a standard deviation that is not negative")
        return self


class Correlation(Strict):
    """How keys of `vary` go together: the correlation of the normal numbers that their distributions are made of."""

    keys: list[str] = Field(min_length=2, description="key paths of `vary`")
    rows: list[list[float]] = Field(description="lower triangle of the matrix, with ones at the ends of its rows")


class CampaignRequirement(RunRequirement, title="Requirement"):
    """A bound on a metric, or a temporal formula, that a share of all trials must keep."""

    share: float = Field(0.95, gt=0, description="smallest share of the trials that must keep the bound")

    @field_validator("share")
    @classmethod
    def _provable(cls, share: float) -> float:
        if share >= 1:
            raise ValueError("be less than 1, because no number of trials can demonstrate 100 %; 0.99, for example")
        return share


class RecordedSignals(Strict, title="Series"):
    """Signals to record for every trial."""

    signals: list[str] = Field(
        ["position", "error"],
        min_length=1,
        description="names of variables of run.nc, as written by `undertow simulate`",
    )
    every: float = Field(1.0, gt=0, description="time between records, s")

    @field_validator("signals")
    @classmethod
    def _once(cls, signals: list[str]) -> list[str]:
        if len(set(signals)) < len(signals):
            raise ValueError("name every signal once")
        return signals


class Campaign(Strict):
    """One campaign: a scenario and what varies from trial to trial."""

    description: str = Field("", description="free text, the title of the page")
    scenario: str | dict[str, Any] = Field(description="name of a scenario file, or the scenario itself")
    trials: int = Field(1000, ge=1, le=10**9, description="number of samples")
    design: Literal["random", "latin", "sobol"] = Field("random", description="sampling of the space of `vary`")
    vary: dict[str, Distribution] = Field(
        default_factory=dict, description="Monte Carlo: key path of the scenario -> its distribution"
    )
    correlation: Correlation | None = Field(None, description="correlation of keys of `vary`; independent by default")
    cross: dict[str, dict[str, Any]] = Field(
        default_factory=dict,
        description="sweep: key path -> values, as a list or by name; all combinations run the same samples and seeds",
    )
    variants: dict[str, dict[str, Any]] = Field(
        default_factory=dict,
        description="name -> key paths and their values: whatever changes together; an axis after those of `cross`",
    )
    requirements: dict[str, CampaignRequirement] = Field(
        default_factory=dict,
        description="metric -> bound that it must keep; or any name -> formula that the run must keep",
    )
    series: RecordedSignals | None = Field(None, description="signals to record; none by default")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="seed of all samples and of the seeds of the trials")
    chunk: int | None = Field(
        None, ge=1, le=100_000, description="trials per task, which does not affect the results; default: 256 to 4096"
    )

    @field_validator("scenario", mode="before")
    @classmethod
    def _file_or_mapping(cls, value: Any) -> Any:
        if not isinstance(value, str | dict):
            raise ValueError("be the name of a file, or a mapping of keys to values")
        return value

    @field_validator("cross", mode="before")
    @classmethod
    def _named(cls, sweeps: Any) -> Any:
        if not isinstance(sweeps, dict):
            return sweeps
        for key, values in sweeps.items():
            if not isinstance(values, list | dict):
                raise ValueError(f"have a list of values for `{key}`, or values by names")
        return {key: by_name(values) if isinstance(values, list) else values for key, values in sweeps.items()}

    @property
    def axes(self) -> dict[str, dict[str, Any]]:
        """Values by names along every axis: the key paths of `cross`, then `variant`."""
        return self.cross | ({VARIANT: self.variants} if self.variants else {})

    @property
    def formulas(self) -> dict[str, str]:
        """Temporal formulas of the requirements, by name."""
        formulas = {name: requirement.formula for name, requirement in self.requirements.items()}
        return {name: formula for name, formula in formulas.items() if formula is not None}

    @property
    def keys(self) -> list[str]:
        """Every key path whose value is not that of the scenario in all trials."""
        return [*self.vary, *self.cross, *(key for variant in self.variants.values() for key in variant)]

    def trials_per_task(self, tasks: int) -> int:
        """Trials per task, where there are to be so many tasks."""
        return self.chunk or min(max(self.number // tasks, _SMALL), _LARGE)

    @property
    def number(self) -> int:
        """Number of trials: the samples, for every combination of `cross` and `variants`."""
        return math.prod(len(entries) for entries in self.axes.values()) * self.trials


# Keys of the sections that a campaign has several times, or not at all by default.
SECTIONS = {
    "each distribution in `vary`": Distribution,
    "`correlation`": Correlation,
    "each requirement": CampaignRequirement,
    "`series`": RecordedSignals,
}


def campaign_json_schema() -> dict[str, Any]:
    """JSON schema (draft 7) of a campaign file, for editors."""
    scenario, schema = scenario_schema(), Campaign.model_json_schema()
    definitions = {**scenario.pop("$defs"), **schema["$defs"], "Scenario": scenario}
    named = {"anyOf": [{"type": "string"}, {"$ref": "#/$defs/Scenario"}]}
    schema["properties"]["scenario"] |= named
    schema["properties"]["cross"]["additionalProperties"] = {"anyOf": [{"type": "array"}, {"type": "object"}]}
    return {**schema, "$schema": scenario.pop("$schema"), "$defs": definitions}


_SHARED = set(Scenario.model_fields) & set(Campaign.model_fields)
_REMEDIES = {
    "scenario": "Run it: undertow simulate {name}; or name it in a campaign file: `scenario: {name}`",
    "vehicle file": "Name it in a scenario, as `plant: {{vehicle: {name}}}`, and that in a campaign",
}


def validate(text: Text) -> Campaign:
    """Validate the contents of a campaign file.

    Raises:
        BadInput: unknown key, wrong type, value out of range.
    """
    if (kind := kind_of({key: text.data[key] for key in text.data if key not in _SHARED})) in _REMEDIES:
        name = text.name or "NAME.yaml"
        raise BadInput(name, "be a campaign", f"a {kind}", hint=_REMEDIES[kind].format(name=name))
    try:
        campaign = Campaign.model_validate(text.data)
    except ValidationError as errors:
        raise complaint(errors, text, Campaign) from None
    pairs = [(section, key) for section in ("vary", "cross") for key in getattr(campaign, section)]
    varied_keys = [key for _, key in pairs]
    for section, key in pairs:
        _check_key(section, key, varied_keys, text.where((section, key)))
    if campaign.correlation is not None:
        _check_correlation(campaign.correlation, campaign.vary, text)
    if campaign.variants and VARIANT in campaign.cross:
        raise BadInput(f"cross.{VARIANT}", "be left out beside `variants`", where=text.where(("cross", VARIANT)))
    for name, variant in campaign.variants.items():
        for key in variant:
            _check_key("variants", key, [*campaign.vary, key], text.where(("variants", name, key)))
    for key, entries in campaign.cross.items():
        _check_entries(key, entries, text.where(("cross", key)))
    return campaign


def _check_key(section: str, key: str, varied_keys: list[str], where: str) -> None:
    """A key path of `vary` or `cross`."""
    if not _PATH.fullmatch(key):
        must = "be a key path such as plant.vehicle.mass or initial.position[0]"
        raise BadInput(section, must, repr(key), where=where)
    if key.startswith("scenario."):
        raise BadInput(key, "start inside the scenario", hint=f"Write `{key.removeprefix('scenario.')}`", where=where)
    if key == "seed":
        hint = "Every trial has its own seed, which follows from the `seed` of the campaign"
        raise BadInput(f"{section}.seed", "be left out", hint=hint, where=where)
    if varied_keys.count(key) > 1:
        raise BadInput(
            f"{section if section == 'variants' else 'cross'}.{key}", "not be in `vary` as well", where=where
        )
    for other_key in varied_keys:
        if other_key.startswith((f"{key}.", f"{key}[")):
            raise BadInput(other_key, f"not be given together with {key}, which contains it", where=where)


def _check_correlation(correlation: Correlation, vary: dict[str, Distribution], text: Text) -> None:
    """Keys and matrix of a correlation."""
    with error_location("correlation", lambda name: text.where(("correlation", *key_path(name)))):
        for i, key in enumerate(correlation.keys):
            if key not in vary or key in correlation.keys[:i]:
                raise BadInput(f"keys[{i}]", "be a key of `vary`, named once", key, hint=nearest(key, vary))
            if vary[key].choice is not None or vary[key].deviations is not None:
                raise BadInput(f"keys[{i}]", "have numbers in order: not a choice", key)
        correlation_matrix("rows", correlation.rows, len(correlation.keys))


def _check_entries(key: str, entries: dict[str, Any], where: str) -> None:
    """The values of one key of `cross`."""
    name = f"cross.{key}"
    if not entries:
        raise BadInput(name, "have an entry", where=where)
    if set(entries) <= set(Distribution.model_fields):
        hint = f"Distributions belong to `vary`. Here, write `{key}: [first, second]`, or names and values"
        raise BadInput(name, "be a list, or values by names", f"{next(iter(entries))} alone", hint=hint, where=where)
    words_by_value: dict[str, str] = {}
    for word, entry in entries.items():
        first_word = words_by_value.setdefault(repr(float(entry) if isinstance(entry, int) else entry), word)
        if first_word != word:
            raise BadInput(name, "have entries that differ", f"twice {words(entry)}", where=where)


def read_campaign(path: Path) -> tuple[Campaign, Text]:
    """A campaign from its file, and the text of the file.

    Raises:
        BadInput: the file is not a valid campaign.
    """
    text = read(path, file="campaign")
    return validate(text), text


def read_text(text: str, folder: Path) -> tuple[Campaign, Text]:
    """A campaign from the text of `whole`; relative paths in it start at `folder`."""
    parsed = parse(text, "", folder, file="campaign")
    return validate(parsed), parsed


def whole(campaign: Campaign, scenario: dict) -> str:
    """The complete campaign as YAML, without `chunk` and free text, which do not affect the results."""
    unused = set() if campaign.variants else {"variants"}
    data = campaign.model_dump(exclude_none=True, exclude={"chunk", "description"} | unused)
    return dump(data | {"scenario": scenario})
