"""Trials of a campaign by number: each is a scenario that `undertow simulate` could run."""

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int, UInt32

from undertow.core.errors import BadInput, error_location
from undertow.scenario.reading import Text, read
from undertow.studies.campaign.campaign_schema import VARIANT, Campaign
from undertow.studies.campaign.labels import is_number, words
from undertow.studies.campaign.sampling import Samples, quantiles
from undertow.studies.campaign.varied_scenario import nominal_model_sentence, varied_scenario
from undertow.studies.campaign.vehicle_deviations import with_vehicle_deviations

# Trials of each combination that are built first, to find errors and the numbers that differ.
_PROBES = 4


class Trials(NamedTuple):
    """All trials by number: every combination of `cross` with the first sample, then with the next one, and so on."""

    campaign: Campaign
    text: Text  # of the campaign file
    scenario: Text  # that it varies, and the folder of relative paths in it
    samples: Samples  # points of the unit cube, for `vary`, and seeds
    combinations: tuple[tuple[Any, ...], ...]  # values of `cross`, one tuple per combination

    @property
    def number(self) -> int:
        """Number of trials."""
        return self.campaign.number

    def values(self, trial: int) -> dict[str, Any]:
        """Values that this trial sets in the scenario, by key path."""
        swept, variant = self._combination(trial)
        return swept | variant | {key: column[0] for key, column in self.sampled(np.array([trial])).items()}

    def sampled(self, trials: Int[np.ndarray, " n"]) -> dict[str, list[Any]]:
        """Sampled values of several trials, by key path."""
        points = self.samples.points(trials // len(self.combinations))
        spreads = self.campaign.vary.items()
        return {key: quantiles(spread, shares) for (key, spread), shares in zip(spreads, points.T, strict=True)}

    def seeds(self, trials: Int[np.ndarray, " n"]) -> UInt32[np.ndarray, " n"]:
        """Seeds of all random numbers of several trials."""
        return self.samples.seeds(trials // len(self.combinations))

    def seed(self, trial: int) -> int:
        """Seed of all random numbers of this trial."""
        return int(self.seeds(np.array([trial]))[0])

    def first(self, combination: int) -> list[int]:
        """The trials of a combination that are built before the first run."""
        return [sample * len(self.combinations) + combination for sample in range(min(_PROBES, self.campaign.trials))]

    def representative_trials(self) -> list[int]:
        """The first trials of all combinations."""
        return [trial for combination in range(len(self.combinations)) for trial in self.first(combination)]

    def data(self, trial: int) -> dict[str, Any]:
        """The scenario of this trial."""
        _, variant = self._combination(trial)  # a scenario of its own, which the controller knows
        return varied_scenario(self.scenario.data, self.values(trial), variant) | {"seed": self.seed(trial)}

    def alternatives(self) -> Iterator[dict[str, Any]]:
        """The scenario of the first trial with each entry of every choice that is not numeric."""
        for key, entries in varied_keys(self.campaign):
            for entry in (entries or {}).values():
                yield varied_scenario(self.data(0), {key: entry})

    def nominal_model(self) -> str:
        """Sentence on what the controller knows of a plant that varies; empty where it does not."""
        _, variant = self._combination(0)
        return nominal_model_sentence(self.scenario.data, self.values(0), variant)

    def _combination(self, trial: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """Values of `cross` and of the variant, by key path."""
        swept = dict(zip(self.campaign.axes, self.combinations[trial % len(self.combinations)], strict=True))
        variant = swept.pop(VARIANT, {}) if self.campaign.variants else {}
        return swept, variant

    def location(self, name: str) -> str:
        """Line that sets a key of the scenario: of the campaign file, or of the scenario's own."""
        campaign = self.campaign
        sections = {("vary",): campaign.vary, ("cross",): campaign.cross}
        sections |= {("variants", variant): keys for variant, keys in campaign.variants.items()}
        for section, keys in sections.items():
            for key in keys:
                if name == key or name.startswith((f"{key}.", f"{key}[")):
                    return self.text.where((*section, key))
        return self.scenario.location(name)


def varied_keys(campaign: Campaign) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """Key paths of `vary`, with the values by name where they are not numbers."""
    for key, spread in campaign.vary.items():
        named = spread.choice is not None and not all(map(is_number, spread.choice))
        yield key, {words(entry): entry for entry in spread.choice or []} if named else None


def trials(campaign: Campaign, text: Text, allow_code: bool = False) -> Trials:
    """The trials of a campaign; `allow_code` lets the code run that an earlier run.nc names, if the scenario is one.

    Raises:
        BadInput: the scenario cannot be read, or there are too many trials.
    """
    if campaign.number >= 2**31:
        raise BadInput("trials", "be less than 2^31 with all combinations of `cross`", campaign.number)
    combinations = tuple(itertools.product(*(entries.values() for entries in campaign.axes.values())))
    scenario = _scenario(campaign, text, allow_code)
    with error_location(location=text.location):
        campaign = with_vehicle_deviations(campaign, scenario)
    return Trials(campaign, text, scenario, Samples(campaign), combinations)


def _scenario(campaign: Campaign, text: Text, allow_code: bool) -> Text:
    scenario = campaign.scenario
    if isinstance(scenario, str):
        with error_location(location=text.location):
            scenario_text = read(text.folder / scenario, "scenario", allow_code)
            if "scenario" in scenario_text.data:
                raise BadInput("scenario", "be the file of a scenario", f"{scenario}, a campaign")
        return scenario_text
    lines = {path[1:]: line for path, line in text.lines.items() if path[0] == "scenario"}
    return Text(scenario, text.name, text.folder, lines)
