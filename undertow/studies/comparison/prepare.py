"""The campaign of a comparison: one axis with the candidates, the same samples and seeds for each."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.core.errors import BadInput
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario import validation
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.consistency import whole_steps
from undertow.scenario.reading import Text, from_data, read
from undertow.scenario.schema import named_law
from undertow.scenario.vehicle_file import has_deviations
from undertow.studies.campaign import task as tasks
from undertow.studies.campaign.campaign_schema import Campaign, validate
from undertow.studies.campaign.prepare import Prepared, prepare_campaign
from undertow.studies.campaign.trials import trials as trials_of
from undertow.studies.comparison.candidates import Candidate, controllers, scenarios
from undertow.studies.comparison.equal_budgets import EqualBudgets
from undertow.studies.comparison.held_out import held_out
from undertow.studies.comparison.tuning_note import TuningNote, tuning_note

TRIALS = 20

# Signals of the time histories, and about how many records each has.
_SIGNALS = ("error", "position", "reference")
_RECORDS = 400

NOT_RANDOM = "nothing in the scenario is random, so that all trials are equal: one is run, and no interval can be given"
VARY = "To compare over a range of conditions, give a campaign file with `vary` (docs/how-to/compare.md)"


class PreparedComparison(NamedTuple):
    """A comparison that is ready to run.

    Attributes:
        prepared: its campaign.
        dimension: what is compared: `controller`, `scenario`, or the swept key of a campaign file.
        names: of the candidates.
        built: the first trial of each.
        notes: how the gains of each came about.
        differing: of scenarios that are compared as a whole: key -> the value in each.
        advice: warnings about the comparison or its first trials.
        budgets: tuning of the controllers with equal budgets; None without.
    """

    prepared: Prepared
    dimension: str
    names: tuple[str, ...]
    built: tuple[Built, ...]
    notes: tuple[TuningNote, ...]
    differing: dict[str, list[str]]
    advice: tuple[str, ...]
    budgets: EqualBudgets | None = None

    @property
    def subject(self) -> str:
        """What is simulated: the description of the scenario, or the name of its file."""
        scenario = self.prepared.trials.scenario
        return str(scenario.data.get("description") or scenario.name)

    @property
    def campaign(self) -> Campaign:
        """The campaign as it runs."""
        return self.prepared.trials.campaign


class _Request(NamedTuple):
    """The campaign that the user asked for."""

    text: Text
    dimension: str
    sources: list[Path | None]  # scenario files that the gains of the candidates come from
    differing: dict[str, list[str]]
    budgets: EqualBudgets | None = None


Tuner = Callable[[Sequence[Candidate], Text], tuple[list[Candidate], EqualBudgets]]


def prepare_comparison(
    sources: Sequence[Path] | Mapping[str, Any],
    entries: Sequence[str] | Mapping[str, Any] | None = None,
    trials: int | None = None,
    allow_code: bool = False,
    tuner: Tuner | None = None,
) -> PreparedComparison:
    """A comparison of controllers on one scenario, of several scenarios, or of what a campaign file sweeps.

    Args:
        sources: files of scenarios, of one campaign, or a scenario as data.
        entries: controllers, see `controllers`; None for several scenarios, or for a campaign with one axis.
        trials: number of samples; None for that of the campaign file, else 20. One where nothing is random.
        allow_code: whether the code that an earlier run.nc names may run.
        tuner: tunes controllers for a scenario, see `equal_budgets`; None to compare them as they are.

    Raises:
        BadInput: anything wrong with the scenarios, the controllers or the number of trials.
    """
    request = _read_request(sources, entries, allow_code, tuner)
    source = request.text._replace(data=request.text.data | ({} if trials is None else {"trials": trials}))
    campaign = validate(source)
    prepared, advice = _prepared(campaign, source, allow_code)
    if not campaign.vary and not any(map(_random, _firsts(prepared))):
        prepared, advice = _prepared(campaign.model_copy(update={"trials": 1}), source, allow_code)
        advice += (f"{NOT_RANDOM}. {VARY}",)
    names = tuple(next(iter(campaign.axes.values())))
    built = _firsts(prepared)
    pairs = enumerate(zip(built, request.sources, strict=True))
    notes = tuple(_note(prepared, number, trial, file) for number, (trial, file) in pairs)
    if request.budgets is not None:
        notes = tuple(TuningNote(law.sentence, not law.untuned) for law in request.budgets.laws)
    advice = (*prepared.advice, *advice, *(_fair(names, notes) if request.budgets is None else ()))
    return PreparedComparison(
        prepared, request.dimension, names, built, notes, request.differing, advice, request.budgets
    )


def _read_request(
    sources: Sequence[Path] | Mapping[str, Any], entries: Any, allow_code: bool, tuner: Tuner | None
) -> _Request:
    budgets = None
    if tuner is not None and entries is None:
        raise BadInput("--tune", "be given with --controllers, whose gains are tuned", "given without")
    differing: dict[str, list[str]] = {}
    dimension = "controller"
    path, vary = None, {}
    if not isinstance(sources, Mapping) and len(sources) > 1:
        if entries is not None:
            strays = [str(path) for path in sources[1:] if not path.suffix and not path.exists()]
            hint = "Compare several controllers on one scenario, or several scenarios as they are"
            if strays:
                hint = f"Separate the controllers by commas: --controllers {','.join([*map(str, entries), *strays])}"
            raise BadInput("--controllers", "be given with one scenario only", f"{len(sources)} scenarios", hint=hint)
        text, candidates, differing = scenarios(sources, allow_code)
        dimension = "scenario"
    else:
        if isinstance(sources, Mapping):
            text = from_data(sources)
        else:
            path = sources[0]
            text = read(path, allow_code=allow_code)
        if "scenario" in text.data and entries is None:
            return _of_file(text)
        if entries is None:
            hint = "For example: --controllers robust,pid; or a second scenario file"
            raise BadInput("--controllers", "name what is compared", "not given", hint=hint)
        base = _scenario_of(text, allow_code)
        candidates = controllers(entries, base, path)
        if tuner is not None:
            candidates, budgets = tuner(candidates, base)
            text = held_out(text, base, budgets)
        if "scenario" not in text.data and has_deviations(base):
            vary = {"plant.vehicle": {"deviations": "file"}}
    if "scenario" not in text.data:
        lines = {("scenario", *key_path): line for key_path, line in text.lines.items()}
        text = text._replace(data={"scenario": text.data} | ({"vary": vary} if vary else {}), lines=lines)
    variants = {"variants": {candidate.name: candidate.changes for candidate in candidates}}
    text = text._replace(data={"trials": TRIALS} | text.data | variants | {"requirements": {}})
    return _Request(text, dimension, [candidate.source for candidate in candidates], differing, budgets)


def _of_file(text: Text) -> _Request:
    """What a campaign file sweeps."""
    text = text._replace(data={"trials": TRIALS} | text.data | {"requirements": {}})
    axes = validate(text).axes
    if len(axes) != 1 or len(next(iter(axes.values()))) < 2:
        got = f"{', '.join(axes)} in the file" if axes else "none in the file"
        hint = "Give --controllers, or sweep one key by `cross`, or by `variants`, with two values or more"
        raise BadInput(text.name, "have one axis with what is compared", got, hint=hint)
    ((axis, entries),) = axes.items()
    return _Request(text, axis, [None] * len(entries), {})


def _scenario_of(text: Text, allow_code: bool) -> Text:
    """The scenario itself, of a scenario or of a campaign file without an axis of its own."""
    if "scenario" not in text.data:
        return text
    campaign = validate(text)
    if campaign.axes:
        hint = f"Leave out --controllers to compare {', '.join(campaign.axes)} of the file, or leave that out"
        raise BadInput("--controllers", "be given for a campaign without `cross` and `variants`", hint=hint)
    return trials_of(campaign, text, allow_code).scenario


def _note(prepared: Prepared, number: int, built: Built, source: Path | None) -> TuningNote:
    """How the gains of a candidate came about."""
    controller = prepared.trials.data(number).get("controller", {})
    return tuning_note(
        named_law(controller), built.closed_loop.controller, built.scenario.loop.dt, prepared.folder, source
    )


def _prepared(campaign: Campaign, source: Text, allow_code: bool) -> tuple[Prepared, tuple[str, ...]]:
    """The campaign with time histories of all candidates; without them, and the reason, where that cannot be."""
    try:
        return prepare_campaign(_recorded(campaign, source, allow_code), source, allow_code), ()
    except BadInput as error:
        if not error.name.startswith("series"):
            raise
        return prepare_campaign(campaign, source, allow_code), (f"no time histories are recorded: {error}",)


def _recorded(campaign: Campaign, source: Text, allow_code: bool) -> Campaign:
    """The campaign with a record of errors and positions."""
    loop = validation.validate(trials_of(campaign, source, allow_code).scenario).loop
    record_period = loop.dt * max(1, round(loop.duration / loop.dt / _RECORDS))
    series = campaign.series
    if series is not None and whole_steps(series.every, loop.dt):
        record_period = series.every
    signals = list(dict.fromkeys([*(series.signals if series else ()), *_SIGNALS]))
    return Campaign.model_validate(campaign.model_dump() | {"series": {"signals": signals, "every": record_period}})


def _firsts(prepared: Prepared) -> tuple[Built, ...]:
    """The first valid trial of each candidate."""
    campaign_trials = prepared.trials
    probes = tasks.task_context(prepared.text, str(prepared.folder)).representative_trials()
    return tuple(
        next(probes[row] for row in campaign_trials.first(number) if row in probes)
        for number in range(len(campaign_trials.combinations))
    )


@in_its_precision
def _random(built: Built) -> bool:
    """Whether a run depends on its seed: whether its random parts differ for two seeds."""
    first, second = (jax.tree.leaves(built.closed_loop.realize(key_of_seed(seed))[1:]) for seed in (1, 2))
    return any(not np.array_equal(leaf, other_leaf) for leaf, other_leaf in zip(first, second, strict=True))


def _fair(names: Sequence[str], notes: Sequence[TuningNote]) -> tuple[str, ...]:
    """Advice where some candidates are tuned and others are not."""
    rivals = [name for name, note in zip(names, notes, strict=True) if not note.tuned]
    if not rivals:
        return ()
    sentence = f"{', '.join(rivals)} {'is' if len(rivals) == 1 else 'are'} not tuned for this scenario"
    sentence += "; with untuned gains a comparison says little about the laws themselves (docs/how-to/compare.md)"
    return (sentence,)
