"""Build the trials of a task: many at once where their numbers can be traced, otherwise one by one.

Building a trial takes a millisecond of Python. Trials that differ only in numbers are built together: the scenario is
built once with arrays of the varied values in place of numbers (`jax.vmap`), which gives the numbers of all of them, to
the bit. A part whose constructor looks at its numbers, by NumPy for example, cannot be built so, nor can a trial that
breaks a condition of a constructor: these are built one by one.
"""

import contextlib
import itertools
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from pydantic import BaseModel

from undertow.core import checks, runtime
from undertow.core.arrays import as_array
from undertow.core.errors import BadInput, error_location
from undertow.scenario.build import Built, build, build_scenario
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import loop_run
from undertow.scenario.reading import Text, key_path
from undertow.simulation.loop.loop_runs import numbers_of, structure
from undertow.simulation.prepared_run import RunBatch, batch_of
from undertow.studies.campaign.requirements import recorded
from undertow.studies.campaign.trial_results import prepare_trial
from undertow.studies.campaign.trials import Trials

# Trials of a kind that are built both ways: where one of them differs in one bit, all are built one by one. The
# arithmetic of a constructor may be rounded in another way for many trials than for one: XLA divides by a number that
# all share by multiplying with its reciprocal. That shows in every seventh number or so.
_COMPARED = 48
_SEARCHED = 2048  # samples among which as many of a kind have to be

# Sections of a scenario whose numbers become numbers of the program; the others are settings of the run.
_TRACED = ("plant", "model", "controller", "reference", "disturbance", "navigation", "metrics", "initial")


class TrialSignature(NamedTuple):
    """What trials have to share in order to be built together."""

    combination: int  # of `cross`
    others: str  # values that are no fractions


class TraceableKinds:
    """Which kinds of trials have numbers that can be traced; the thread that needs one first finds it out."""

    def __init__(self) -> None:
        self._known: dict[TrialSignature, bool] = {}
        self._finding = threading.Lock()

    def __call__(self, kind: TrialSignature, find: Callable[[], bool]) -> bool:
        """What is known of a kind, or what `find` gives."""
        with self._finding:
            if kind not in self._known:
                self._known[kind] = find()
            return self._known[kind]


class TrialBatch(NamedTuple):
    """Valid trials of a task that differ only in numbers."""

    places: np.ndarray  # in the task
    first: Built  # one of them
    batch: RunBatch


def build_trial(campaign_trials: Trials, part_cache: PartCache, row: int) -> Built:
    """One trial, ready to run.

    Raises:
        BadInput: its scenario cannot be built.
    """
    with error_location(location=campaign_trials.location, note=f"trial {row}"):
        return build_data(campaign_trials, part_cache, campaign_trials.data(row))


def build_data(campaign_trials: Trials, part_cache: PartCache, data: dict[str, Any]) -> Built:
    """Build a scenario of the campaign.

    Raises:
        BadInput: the scenario cannot be built.
    """
    return build(Text(data, "", campaign_trials.scenario.folder, {}), part_cache)


def valid_trials(campaign_trials: Trials, part_cache: PartCache, rows: Iterable[int]) -> Iterator[tuple[int, Built]]:
    """Index and trial of each valid row, one at a time: a large task does not keep them all in memory."""
    for index, row in enumerate(rows):
        with contextlib.suppress(BadInput):
            yield index, build_trial(campaign_trials, part_cache, row)


def build_trials(
    campaign_trials: Trials,
    part_cache: PartCache,
    trials: np.ndarray,
    sampled: Mapping[str, list[Any]],
    traceable: TraceableKinds,
) -> Iterator[TrialBatch]:
    """The valid trials among some: those whose numbers can be traced together, the others each by itself.

    Args:
        campaign_trials: the trials of the campaign.
        part_cache: parts that they share.
        trials: their numbers in the campaign.
        sampled: their sampled values, by key path.
        traceable: which kinds of trials can be traced, a matter of the campaign only.
    """
    varied = _fractions(campaign_trials)
    for kind, places in _by_kind(campaign_trials, trials, sampled, varied).items():
        traced_batch = None
        if traceable(kind, partial(_traceable, campaign_trials, part_cache, kind, varied)):
            numbers = {key: np.array(sampled[key])[places] for key in varied}
            traced_batch = _together(campaign_trials, part_cache, trials[places], numbers)
        if traced_batch is not None:
            yield traced_batch._replace(places=places[traced_batch.places])
            places = np.delete(places, traced_batch.places)
        for index, built in valid_trials(campaign_trials, part_cache, trials[places].tolist()):
            prepared = prepare_trial(built, recorded(campaign_trials.campaign, built))
            yield TrialBatch(places[[index]], built, batch_of(prepared))


def _fractions(campaign_trials: Trials) -> list[str]:
    """Key paths of `vary` whose values are fractions; the others are counts, words or parts."""
    fraction = lambda spread: all(type(value) is float for value in spread.choice or ())
    return [key for key, spread in campaign_trials.campaign.vary.items() if fraction(spread)]


def _by_kind(
    campaign_trials: Trials, trials: np.ndarray, sampled: Mapping[str, list[Any]], varied: list[str]
) -> dict[TrialSignature, np.ndarray]:
    """Places of trials by kind: one combination of `cross`, and the same values where these are no fractions."""
    discrete_columns = [column for key, column in sampled.items() if key not in varied]
    groups: dict[TrialSignature, list[int]] = {}
    for index, trial in enumerate(trials.tolist()):
        values = [column[index] for column in discrete_columns]
        kind = TrialSignature(trial % len(campaign_trials.combinations), repr(values))
        groups.setdefault(kind, []).append(index)
    return {kind: np.array(places) for kind, places in groups.items()}


def _traceable(campaign_trials: Trials, part_cache: PartCache, kind: TrialSignature, varied: list[str]) -> bool:
    """Whether the first trials of a kind have the same bits when they are built together and alone."""
    if any(key_path(key)[0] not in _TRACED for key in varied):
        return False
    samples = np.arange(min(_SEARCHED, campaign_trials.campaign.trials))
    trials = samples * len(campaign_trials.combinations) + kind.combination
    sampled = campaign_trials.sampled(trials)
    of_kind = _by_kind(campaign_trials, trials, sampled, varied).get(kind, samples[:0])[:_COMPARED]
    if len(of_kind) < _COMPARED:
        return False
    numbers = {key: np.array(sampled[key])[of_kind] for key in varied}
    return _together(campaign_trials, part_cache, trials[of_kind], numbers, _COMPARED) is not None


def _together(
    campaign_trials: Trials,
    part_cache: PartCache,
    trials: np.ndarray,
    varied: Mapping[str, np.ndarray],
    compared: int = 1,
) -> TrialBatch | None:
    """Those of some trials that meet all conditions; None where their numbers cannot be traced.

    Args:
        campaign_trials: the trials of the campaign.
        part_cache: parts that they share.
        trials: their numbers in the campaign.
        varied: values of the keys that vary.
        compared: how many valid ones, from the first one on, are built alone too and have to have the same bits.
    """
    built_alone = dict(itertools.islice(valid_trials(campaign_trials, part_cache, trials.tolist()), compared))
    if not built_alone:
        return None
    first = built_alone[min(built_alone)]
    batch = batch_of(prepare_trial(first, recorded(campaign_trials.campaign, first)))
    try:
        form = structure(batch.first.run)
        numbers, conditions = _traced(part_cache, first, varied, form) if varied else (batch.numbers.copy(), [])
    except Exception:  # whatever a constructor, of a user's own too, does with numbers that are not known
        return None
    seeds = campaign_trials.seeds(trials)
    numbers[-1] = np.stack([np.zeros_like(seeds), seeds], axis=1)  # the random keys
    valid = np.logical_and.reduce([np.ones(len(trials), dtype=bool), *conditions])
    # Every valid trial up to the last one built alone has to agree: one that only tracing accepts, or that differs in
    # one bit, shows that the numbers of this kind cannot be traced.
    for index in np.flatnonzero(valid[: max(built_alone) + 1]).tolist():
        if index not in built_alone or not _same(batch.first.run, numbers, index, loop_run(built_alone[index])):
            return None
    places = np.flatnonzero(valid)
    batch_numbers = [None if number is None else number[places] for number in numbers]
    return TrialBatch(places, first, batch._replace(numbers=batch_numbers, size=len(places)))


def _same(first: Any, numbers: list[np.ndarray | None], index: int, built_alone: Any) -> bool:
    """Whether a trial has the same bits as when it is built alone."""
    if structure(first) != structure(built_alone):
        return False
    pairs = zip(numbers_of(first), numbers, strict=True)
    batch_leaves = [leaf if number is None else number[index] for leaf, number in pairs]
    of_both = zip(batch_leaves, numbers_of(built_alone), strict=True)
    return all(np.asarray(a).tobytes() == np.asarray(b).tobytes() for a, b in of_both)


def _traced(
    part_cache: PartCache, first: Built, varied: Mapping[str, np.ndarray], form: Any
) -> tuple[list[np.ndarray | None], list[np.ndarray]]:
    """Numbers of the program with a leading axis over trials, None for those that do not vary; and the conditions."""
    vary: list[bool] = []

    def numbers(values: dict[str, Any]) -> tuple[list[Any], list[Any]]:
        scenario = first.scenario
        for key, value in values.items():
            scenario = with_value(scenario, key_path(key), value)
        with checks.recorded_conditions() as conditions:
            run = loop_run(build_scenario(scenario, first.text, part_cache.copy()))
        if structure(run) != form:
            raise checks.Unknown
        vary[:] = [isinstance(leaf, Tracer) for leaf in numbers_of(run)]
        return [leaf for leaf in numbers_of(run) if isinstance(leaf, Tracer)], conditions

    with runtime.in_precision("float64"):
        traced_leaves, conditions = jax.vmap(numbers)(dict(varied))
    columns = map(np.asarray, traced_leaves)
    return [next(columns) if varies else None for varies in vary], list(map(np.asarray, conditions))


def with_value(node: Any, path: tuple[str | int, ...], value: Any) -> Any:
    """A scenario, or what is in it, with another value at a path; a list of numbers becomes an array."""
    if not path:
        return value
    step, *inner_path = path
    if isinstance(node, BaseModel):
        return node.model_copy(update={str(step): with_value(getattr(node, str(step)), tuple(inner_path), value)})
    if isinstance(node, jax.Array):
        return node.at[step].set(value)
    inner = node.copy()
    inner[step] = with_value(node[step], tuple(inner_path), value)
    numeric = isinstance(inner, list) and all(isinstance(entry, float | int | Tracer) for entry in inner)
    return jnp.stack([as_array(entry) for entry in inner]) if numeric else inner
