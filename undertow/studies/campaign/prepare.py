"""Read a campaign and build its first trials, so that errors appear before the first run."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core import checks
from undertow.core.batch_compiler import unavailable
from undertow.core.errors import BadInput, did_you_mean, error_location
from undertow.core.metric import Metric
from undertow.scenario.build import Built
from undertow.scenario.checks.vehicle_lint import vehicle_advice
from undertow.scenario.consistency import whole_steps
from undertow.scenario.reading import Text
from undertow.scenario.results.run_result import law_of, rules
from undertow.scenario.validation import check_kind
from undertow.studies.campaign import task as tasks
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.campaign_schema import Campaign, read_campaign, whole
from undertow.studies.campaign.requirements import check_formulas, too_few
from undertow.studies.campaign.task import reasons
from undertow.studies.campaign.trials import Trials, trials


class Prepared(NamedTuple):
    """A campaign that is ready to run."""

    trials: Trials
    text: str
    folder: Path
    first: Built  # a trial
    metrics: dict[str, Metric]  # that any of the trials may have
    named: tuple[dict[str, Any], ...]  # scenarios that include the contents of all files they name
    advice: tuple[str, ...]  # warnings about the campaign or its first trials


def prepare(path: Path, allow_code: bool = False) -> Prepared:
    """Read a campaign and build its first trials; see `prepare_campaign`."""
    return prepare_campaign(*read_campaign(path), allow_code)


def prepare_campaign(campaign: Campaign, source: Text, allow_code: bool = False) -> Prepared:
    """Build the first trials of every combination of a campaign, so that errors appear before the first run.

    Args:
        campaign: what to run.
        source: its text.
        allow_code: whether the code may run that an earlier run.nc names, if the scenario is one.

    Raises:
        BadInput: anything wrong with the campaign or its scenario; none of the first trials can be built.
    """
    campaign_trials = trials(campaign, source, allow_code)
    campaign = campaign_trials.campaign  # with the deviations of a vehicle file
    check_kind(campaign_trials.scenario, "scenario", source.where(("scenario",)))
    text = whole(campaign, campaign_trials.scenario.data)
    folder = campaign_trials.scenario.folder
    tasks.task_context.cache_clear()  # files that it names may have changed since this process last read them
    context = tasks.task_context(text, str(folder))
    firsts = [_first(campaign_trials, context, combination) for combination in range(len(campaign_trials.combinations))]
    with error_location(location=source.location):
        _check_shapes(campaign, context.representative_trials().values())
    metrics = context.metrics()
    advice: dict[str, str] = {}
    for row, built in firsts:
        with error_location(location=source.location):
            _check(campaign, built, metrics)
        with error_location(location=campaign_trials.location):
            trial_advice = (*built.advice(), *vehicle_advice(built))
        for warning in trial_advice:
            advice.setdefault(warning.sentence, f"trial {row}: {warning.sentence}")
    by_simd = any(built.scenario.loop.backend == "simd" for _, built in firsts)
    why = unavailable() if by_simd else ""
    slower = (f"trials are computed by backend xla, which is slower: {why}",) if why else ()
    advice_given = (*slower, *too_few(campaign), *_invalid(campaign_trials, context), *advice.values())
    named = (*(built.resolved for _, built in firsts), *(built.resolved for built in context.alternatives()))
    return Prepared(campaign_trials, text, folder, firsts[0][1], metrics, named, advice_given)


def _invalid(campaign_trials: Trials, context: tasks.TaskContext) -> tuple[str, ...]:
    """Why some of the first trials cannot be built."""
    rows = campaign_trials.representative_trials()
    groups = reasons(campaign_trials, [row for row in rows if row not in context.representative_trials()])
    return tuple(f"{group.trials} of the first {len(rows)} trials are invalid: {group.why}" for group in groups)


def _first(campaign_trials: Trials, context: tasks.TaskContext, combination: int) -> tuple[int, Built]:
    """The first trial of a combination that can be built.

    Raises:
        BadInput: none of the first trials can be built; the error of the first one.
    """
    rows = campaign_trials.first(combination)
    for row in rows:
        if row in context.representative_trials():
            return row, context.representative_trials()[row]
    return rows[0], build_trial(campaign_trials, context.part_cache, rows[0])


def _check(campaign: Campaign, built: Built, metrics: Mapping[str, Metric]) -> None:
    """Check what a campaign requires of its runs."""
    loop = built.scenario.loop
    if loop.kind != "sampled":
        raise BadInput("scenario.loop.kind", "be sampled in a campaign", loop.kind)
    for name in campaign.requirements:
        if name not in metrics:
            raise BadInput(f"requirements.{name}", "be a metric", "unknown", hint=did_you_mean(name, metrics))
    check_formulas(campaign, built)
    if campaign.series is None:
        return
    for key in campaign.keys:
        if key in ("loop", "loop.dt", "loop.duration"):
            raise BadInput("series", "be of runs of one length and sampling time", f"given together with {key}")
    for i, name in enumerate(campaign.series.signals):
        checks.choice(f"series.signals[{i}]", name, tuple(built.closed_loop.signals()))
    if not whole_steps(campaign.series.every, loop.dt):
        must = f"be a whole number of sampling times ({loop.dt:g} s)"
        raise BadInput("series.every", must, f"{campaign.series.every:g} s")
    if campaign.series.every > loop.duration:
        raise BadInput("series.every", f"be at most the duration ({loop.duration:g} s)", f"{campaign.series.every:g} s")


def _check_shapes(campaign: Campaign, first_trials: Iterable[Built]) -> None:
    """Check that series have the same shape in all trials, because one array holds them."""
    if campaign.series is None and not campaign.formulas:
        return
    hint = "Leave it out, or run a separate campaign for each of them"
    name = "series" if campaign.series is not None else f"requirements.{next(iter(campaign.formulas))}"
    loops = [built.closed_loop for built in first_trials]
    if len({(loop.plant.outputs, loop.plant.inputs()) for loop in loops}) > 1:
        raise BadInput(name, "be of plants with the same outputs and inputs", "of several", hint=hint)
    if (
        campaign.series is not None
        and "weights" in campaign.series.signals
        and len({rules(law_of(loop)) for loop in loops}) > 1
    ):
        must = "not contain weights where controllers have different numbers of rules"
        raise BadInput("series.signals", must, "with weights", hint=hint)
