"""Tune the controller of a scenario: certified gains, and their evaluation on held-out runs."""

import contextlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core import runtime
from undertow.core.contracts import AbstractController
from undertow.core.errors import BadInput, error_location
from undertow.scenario.build import in_its_precision
from undertow.scenario.provenance import text_hash
from undertow.scenario.reading import Text, dump
from undertow.simulation.checkpoint import Checkpoint, OutOfTime
from undertow.studies.tuning.cost import Shares
from undertow.studies.tuning.evaluator import AT_ONCE, Evaluation
from undertow.studies.tuning.objective import Improvement, Objective, Watch
from undertow.studies.tuning.problem import Problem, problem
from undertow.studies.tuning.search import descend, evolve, search, spread_points
from undertow.studies.tuning.stability import Certificate, Certifier, no_certificate

METHODS = ("gradient", "search", "evolution")

# Share of the budget for the search; the rest is for the final evaluation.
_FOR_THE_SEARCH = 0.85

# Metrics of a run, and what a tuning has of them.
_ERRORS = {"position_rms": "position", "attitude_rms": "attitude"}

INITIAL_DESIGN = 2 * AT_ONCE  # points that are evaluated before the search, including the given gains


class Evaluated(NamedTuple):
    """One choice of gains on both sets of trials."""

    name: str
    options: Mapping[str, Any] | None  # None for the gains as given
    train: Shares  # arrays, one entry per trial
    held_out: Shares
    train_cost: float
    held_out_cost: float
    certificate: Certificate

    def held_out_error(self, metric: str) -> float:
        """Rms over the held-out runs of `position_rms` or `attitude_rms`, m or rad."""
        return float(np.sqrt((np.asarray(getattr(self.held_out, _ERRORS[metric])) ** 2).mean()))


class Tuned(NamedTuple):
    """Result of a tuning."""

    problem: Problem
    method: str
    evaluated: tuple[Evaluated, ...]  # given, ..., start, tuned
    steps: list[Improvement]
    evaluations: int
    rejected: int  # points that would have been better, but have no certificate
    elapsed: float  # s
    finished: bool  # whether the search converged within the time, or used up the evaluations
    searched: int  # points that were evaluated after the initial design

    @property
    def kept(self) -> Evaluated:
        """The tuned gains where they are better on held-out runs, or the given ones have no certificate; else these.

        They are not better where they break a limit that the given ones keep.
        """
        initial, *_, tuned = self.evaluated
        better = tuned.held_out_cost < initial.held_out_cost and not self.broken
        return tuned if better or not initial.certificate.holds else initial

    @property
    def broken(self) -> tuple[str, ...]:
        """Metrics of the scenario's success that the given gains keep on held-out runs, and the tuned ones do not."""
        initial, *_, tuned = self.evaluated
        limits = self.problem.built.criterion().items()
        return tuple(
            metric
            for metric, most in limits
            if metric in _ERRORS and initial.held_out_error(metric) < most <= tuned.held_out_error(metric)
        )

    @property
    def scenario(self) -> dict[str, Any]:
        """The scenario with the gains that are kept."""
        return self.problem.scenario(self.kept.options or {})


@in_its_precision
def tune(
    text: Text,
    checkpoint: Path,
    *,
    method: str = "search",
    budget: float = 240.0,
    started: float | None = None,
    evaluations: int | None = None,
    resume: bool = False,
    say: Callable[[str], None] = lambda stage: None,
    watch: Watch = lambda best, evaluations: None,
) -> Tuned:
    """Tune the controller of a scenario.

    Args:
        text: the scenario.
        checkpoint: file from which an interrupted tuning is resumed.
        method: `gradient`, quasi-Newton steps with the gradient by differences; `search`, differential evolution; or
            `evolution`, mutation and selection around the best point, for few evaluations.
        budget: s, in total; the first half of the initial design is always evaluated, and a batch that has begun is
            completed.
        started: `time.perf_counter()` at which the budget begins; None for now.
        evaluations: budget in evaluations of gains instead, at least those of the initial design, so that the result
            does not depend on the speed of the machine. All of them are used: where the method has converged,
            `evolution` goes on from the best point. A gradient counts as two for each parameter.
        resume: whether to resume from the checkpoint.
        say: called with the current stage.
        watch: called with the best so far after every batch.

    Raises:
        BadInput: the scenario, or the checkpoint to resume, is invalid; or the budget ends while the program of the
            runs is compiled.
        NoCertificate: no point of the initial design has a certificate.
    """
    if evaluations is not None:
        if evaluations < INITIAL_DESIGN:
            raise BadInput("evaluations", f"be at least {INITIAL_DESIGN}, the initial design", evaluations)
        budget = math.inf
    start_time = time.perf_counter() if started is None else started
    say("building")
    task = problem(text)
    counted = {} if evaluations is None else {"evaluations": evaluations}
    settings = {"method": method, "tune": task.built.scenario.tune.model_dump(), **counted}
    fingerprint = text_hash(dump({**settings, **task.built.resolved}))
    notes = Checkpoint(checkpoint, fingerprint, _FOR_THE_SEARCH * budget, resume, start_time)
    evaluation, certifier = _prepared(task, notes, budget, say)
    tried: dict[str, Certificate] = {}

    def certify(point: np.ndarray) -> Certificate:
        pairs = zip(task.parameters, point, strict=True)
        gains_text = ", ".join(f"{parameter.name} = {parameter.value(share):.3g}" for parameter, share in pairs)
        tried[gains_text] = certifier(evaluation.law(point))
        return tried[gains_text]

    objective = Objective(evaluation, certify, notes, watch, evaluations)
    seed, iterations = task.built.scenario.seed, task.built.scenario.tune.iterations
    points = np.vstack([task.start, spread_points(INITIAL_DESIGN - 1, len(task.parameters), seed)])
    say("evaluating the initial design")
    objective.costs(points[:AT_ONCE], must=True)  # otherwise slow compiling would leave no result
    finished = True
    with contextlib.suppress(OutOfTime):
        objective.costs(points[AT_ONCE:])
    designed = objective.evaluations
    start = objective.best
    if start is None:
        with error_location(location=text.location):
            raise no_certificate(certifier(evaluation.law(task.start)), tried, designed)
    say("tuning")
    try:
        if method == "gradient":
            descend(objective, np.array(start.point), start.cost, iterations)
        elif method == "evolution":
            evolve(objective, np.array(start.point), start.cost, iterations, seed)
        else:
            search(objective, np.array(start.point), iterations, seed)
        while evaluations is not None:  # until they are used up
            at = objective.best or start
            seed = (seed + 1) % 2**32
            evolve(objective, np.array(at.point), at.cost, iterations, seed)
    except OutOfTime:
        finished = evaluations is not None
    say("evaluating on held-out runs")
    best = objective.best or start
    chosen = {name: task.rounded(np.array(step.point)) for name, step in (("start", start), ("tuned", best))}
    evaluated = _evaluate(task, evaluation, certifier, chosen)
    if not evaluated[-1].certificate.holds:
        raise BadInput("tune", "find gains whose certificate holds after rounding", evaluated[-1].certificate.worst)
    return Tuned(
        problem=task,
        method=method,
        evaluated=evaluated,
        steps=objective.steps,
        evaluations=objective.evaluations,
        rejected=objective.rejected,
        elapsed=notes.elapsed,
        finished=finished,
        searched=objective.evaluations - designed,
    )


@in_its_precision
def compare_gains(text: Text, choices: Mapping[str, Mapping[str, Any]]) -> tuple[Evaluated, ...]:
    """Evaluate the gains of a scenario, and other choices of its options by name, on the runs that `tune` would use.

    Scenarios that differ only in their controller use the same runs.

    Raises:
        BadInput: the scenario is invalid.
    """
    task = problem(text)
    evaluation = _evaluation(task, [task.law(options) for options in choices.values()])
    return _evaluate(task, evaluation, _certifier(task), choices)


def _prepared(
    task: Problem, notes: Checkpoint, budget: float, say: Callable[[str], None]
) -> tuple[Evaluation, Certifier]:
    """What evaluates gains and what certifies them, compiled.

    Raises:
        BadInput: the budget ends before they are; they go on in their threads until the process ends.
    """
    say("compiling")
    evaluation = _evaluation(task)
    threads = runtime.workers(2)
    program, certifier = threads.submit(evaluation.compile), threads.submit(_certifier, task)
    try:
        notes.wait(program, "compiling", say)
        return evaluation, notes.wait(certifier, "finding the operating points of the certificate", say)
    except OutOfTime:
        hint = "Nothing was tuned. What is compiled now is not kept: give a longer budget"
        must = "suffice for compiling the runs and finding the operating points of the certificate"
        raise BadInput("--budget", must, f"{budget:g} s", hint=hint) from None
    finally:
        threads.shutdown(wait=False)


def _evaluation(task: Problem, further_examples: Sequence[AbstractController] = ()) -> Evaluation:
    """What evaluates controllers of the kind that is tuned; `further_examples` have more numbers than these."""
    make = lambda point: task.law(task.options(point))
    ends = [make(np.full(len(task.start), share)) for share in (0.0, 1.0)]
    examples = [make(task.start), *ends, task.built.closed_loop.controller, *further_examples]
    return Evaluation(task.training_loop, make, examples, (task.train, task.held_out))


def _certifier(task: Problem) -> Certifier:
    return Certifier(task.training_loop, task.train, task.law(task.options(task.start)))


def _evaluate(
    task: Problem, evaluation: Evaluation, certifier: Certifier, candidates: Mapping[str, Mapping[str, Any]]
) -> tuple[Evaluated, ...]:
    """Evaluate the given gains, without rounding, and other choices on both sets of trials."""
    chosen = {"given": None, **candidates}
    laws = [task.built.closed_loop.controller, *(task.law(options) for options in candidates.values())]
    train, held_out = (evaluation.shares(laws, trials) for trials in (task.train, task.held_out))
    costs = [evaluation.total(parts).mean(axis=1) for parts in (train, held_out)]
    row = lambda parts, i: Shares(*(np.asarray(part)[i] for part in parts))  # pyright: ignore[reportArgumentType] - NumPy's means
    return tuple(
        Evaluated(
            name, options, row(train, i), row(held_out, i), float(costs[0][i]), float(costs[1][i]), certifier(laws[i])
        )
        for i, (name, options) in enumerate(chosen.items())
    )


def as_scenario(tuned: Tuned) -> str:
    """YAML that `undertow simulate` takes, with the certificate above it."""
    gains = tuned.kept
    origin = (
        "Gains found by" if gains.name == "tuned" else "The given gains, better on held-out runs than those found by"
    )
    sets = list(dict.fromkeys(name for name in tuned.problem.train.variants if name))
    points = f"{len(gains.certificate.radii)} operating points" + (f" of {', '.join(sets)}" if sets else "")
    head = (
        f"# {origin} `undertow tune`, method {tuned.method}.\n"
        f"# Certificate: the exactly linearised closed loop has a spectral radius of {gains.certificate.worst:.6f},\n"
        f"# below 1, over one control step; this is the largest at {points}.\n"
        f"# Cost {gains.train_cost:.6g} on training runs, {gains.held_out_cost:.6g} on held-out runs.\n"
    )
    return head + dump(tuned.scenario)


def as_data(tuned: Tuned) -> dict[str, Any]:
    """Contents of tuning.json; parts of the cost per run, in the order of `trials`."""
    sets = {"train": tuned.problem.train, "held_out": tuned.problem.held_out}
    return {
        "method": tuned.method,
        "elapsed": tuned.elapsed,
        "finished": tuned.finished,
        "evaluations": tuned.evaluations,
        "rejected": tuned.rejected,
        "parameters": [
            {"name": parameter.name, "low": parameter.low, "high": parameter.high}
            for parameter in tuned.problem.parameters
        ],
        "trials": {
            name: {"variants": list(trials.variants), "sizes": np.asarray(trials.sizes).tolist()}
            for name, trials in sets.items()
        },
        "gains": {gains.name: _entries(gains) | {"options": _written(tuned, gains)} for gains in tuned.evaluated},
        "kept": tuned.kept.name,
        "history": [step._asdict() for step in tuned.steps],
    }


def _written(tuned: Tuned, evaluated: Evaluated) -> Mapping[str, Any]:
    """The tuned options as a scenario with these gains has them."""
    if evaluated.options is not None:
        return evaluated.options
    controller = tuned.problem.built.resolved["controller"]
    return {name: controller.get(name) for name in tuned.evaluated[-1].options or {}}


def _entries(evaluated: Evaluated) -> dict[str, Any]:
    return {
        "train_cost": evaluated.train_cost,
        "held_out_cost": evaluated.held_out_cost,
        "spectral_radii": list(evaluated.certificate.radii),
        "train": {name: np.asarray(part).tolist() for name, part in evaluated.train._asdict().items()},
        "held_out": {name: np.asarray(part).tolist() for name, part in evaluated.held_out._asdict().items()},
    }
