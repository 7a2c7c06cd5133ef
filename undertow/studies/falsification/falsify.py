"""Falsify a scenario: break a requirement within bounds, then shrink what broke it."""

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.analysis.temporal.requirements import Requirement, contiguous, evaluate_requirements, needed_signals
from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean, error_location
from undertow.scenario.build import Built, build
from undertow.scenario.consistency import record_period
from undertow.scenario.provenance import text_hash
from undertow.scenario.reading import Text, dump
from undertow.scenario.results.run_result import ScenarioResult
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.schema import Falsify
from undertow.simulation.checkpoint import Checkpoint
from undertow.studies.campaign.varied_scenario import nominal_model_sentence
from undertow.studies.falsification.box import Box, box_of, scenario_at
from undertow.studies.falsification.evaluator import Evaluator
from undertow.studies.falsification.gradient import Gradient
from undertow.studies.falsification.objective import Broken, BudgetSpent, RobustnessObjective, ToBreak, Violation, Watch
from undertow.studies.falsification.shrink import corners, shrink
from undertow.studies.tuning.search import descend, search, spread_points

METHODS = ("gradient", "search")

_NOMINAL = 32  # seeds of the nominal scenario that are checked at most
_SPREAD = 32  # points of the initial design beside the corners
_BIASED = 128  # points of the first round, many at bounds
_DESCENTS = 2  # from the best points
_ITERATIONS = 20  # of a descent
_GENERATIONS = 10  # of the first population; about as many runs as points at bounds, and twice as many every round
_MOST = 1e300  # robustness of a departure whose scenario cannot be built, in a checkpoint


Robustness = Callable[[np.ndarray, Sequence[int]], np.ndarray]  # departures and the seeds of their runs


class Falsified(NamedTuple):
    """What was found.

    Attributes:
        evaluator: of the scenario, and what varied.
        objective: all runs.
        violation: the smallest; None where nothing was broken.
        broken: robustness of every requirement at the violation, by name.
        single_runs: the nominal run and that of the violation, each run by itself.
        method: gradient or search.
        differentiated: whether gradients came from differentiation; otherwise from differences, or there were none.
        finished: whether the search converged within the budget.
        seed: of the search.
    """

    evaluator: Evaluator
    objective: RobustnessObjective
    violation: Violation | None
    broken: dict[str, float]
    single_runs: tuple[ScenarioResult, ...]
    method: str
    differentiated: bool
    finished: bool
    seed: int

    @property
    def box(self) -> Box:
        """What varied."""
        return self.evaluator.box

    def values(self) -> dict[str, float | int]:
        """Numbers of the counter-example by key path; {} without one."""
        return self.box.values(self.violation.departure) if self.violation is not None else {}

    def nominal_model(self) -> str:
        """Sentence on what the controller knows of a plant that varies; empty where it does not."""
        return nominal_model_sentence(self.evaluator.text.data, {axis.key: axis.nominal for axis in self.box.axes})

    def repeated(self) -> bool:
        """Whether the run of the counter-example by itself has the same robustness, bit for bit."""
        rerun = judged_alone(self.evaluator.requirements, self.single_runs[-1])
        return self.violation is not None and rerun == self.broken


def falsify(
    text: Text,
    *,
    budget: int,
    checkpoint: Path | None = None,
    resume: bool = False,
    seed: int = 0,
    method: str = "gradient",
    say: Callable[[str], None] = lambda stage: None,
    watch: Watch = lambda runs, least, smallest: None,
) -> Falsified:
    """Look for the smallest departure from a scenario that breaks a requirement.

    Args:
        text: the scenario, with `falsify` and `requirements`; without these, its criterion of success is to be broken.
        budget: number of runs at most.
        checkpoint: file that keeps the runs, so that the search can be resumed; None to keep none.
        resume: whether to resume from the checkpoint.
        seed: of the search.
        method: gradient or search.
        say: called with the current stage.
        watch: called after every batch of runs.

    Raises:
        BadInput: nothing varies or is required, or the nominal scenario violates a requirement.
    """
    checks.choice("--method", method, METHODS)
    evaluator = evaluator_of(text)
    compute = evaluator.robustness if checkpoint is None else _kept(evaluator, checkpoint, resume, (method, seed))
    objective = RobustnessObjective(compute, evaluator.box, evaluator.seeds, budget, watch)
    say("nominal run")
    _check_nominal(evaluator)
    gradient = Gradient(evaluator, objective.robustness, method == "gradient")
    finished = True
    try:
        chance = np.random.default_rng(seed)
        ends = corners(objective, chance)
        say("breaking a requirement")
        _break(objective, gradient, ends, method, seed)
        if objective.smallest is not None:
            say("shrinking the violation")
            shrink(objective, gradient, ends, seed)
    except BudgetSpent:
        finished = False
    violation = objective.smallest
    say("running the counter-example by itself" if violation is not None else "running the nominal scenario by itself")
    broken = dict[str, float]()
    runs = (run_scenario(evaluator.nominal),)
    if violation is not None:
        names = [requirement.name for requirement in evaluator.requirements]
        broken = dict(zip(names, evaluator.each(violation.departure[None], [violation.seed])[0].tolist(), strict=True))
        counterexample = evaluator.built(violation.departure, violation.seed)
        assert counterexample is not None  # it has a robustness
        runs = (*runs, run_scenario(counterexample))
    return Falsified(evaluator, objective, violation, broken, runs, method, gradient.differentiated, finished, seed)


def judged_alone(requirements: Sequence[Requirement], result: ScenarioResult) -> dict[str, float]:
    """Robustness of every requirement in one run of a scenario, by name."""
    loop = result.built.scenario.loop
    names = needed_signals(requirements)
    verdicts = evaluate_requirements(
        requirements,
        contiguous(result.outcome.signals, names),
        record_period(loop),
        result.steady or {},
        int(result.status),
        float(result.outcome.ended),
        loop.duration,
    )
    return {name: verdict.robustness for name, verdict in verdicts.items()}


def _kept(evaluator: Evaluator, path: Path, resume: bool, search_options: tuple[str, int]) -> Robustness:
    """Robustness of departures with their seeds, from the checkpoint as far as it goes."""
    settings = evaluator.nominal.scenario.falsify.model_dump()
    fingerprint = text_hash(dump({"how": list(search_options), "falsify": settings, **evaluator.nominal.resolved}))
    checkpoint = Checkpoint(path, fingerprint, np.inf, resume, what="falsification")

    def compute(departures: np.ndarray, seeds: Sequence[int]) -> np.ndarray:
        numbers = lambda: np.minimum(evaluator.robustness(departures, seeds), _MOST).tolist()  # JSON has no infinity
        return np.asarray(checkpoint.ask("robustness", np.column_stack([departures, seeds]), numbers))

    return compute


def evaluator_of(text: Text) -> Evaluator:
    """The runs of a scenario within the bounds of its section `falsify`.

    Raises:
        BadInput: nothing varies or is required; a key path leads nowhere; the loop is not sampled.
    """
    with error_location(location=text.location):
        built = build(text)
        settings, loop = built.scenario.falsify, built.scenario.loop
        if loop.kind != "sampled":
            raise BadInput("loop.kind", "be sampled for `undertow falsify`", loop.kind)
        box = box_of(settings.vary, built)
        # Metrics of a batch are of every control step.
        every_step = text._replace(data={**text.data, "steady": {**text.data.get("steady", {}), "every_step": True}})
        evaluator = Evaluator(every_step, build(every_step), box, _required(built, settings))
        for axis in box.axes:
            with error_location(f"falsify.vary.{axis.key}"):
                scenario_at(text, {axis.key: axis.high})
        for departure in (*np.diag(box.lower), *np.diag(box.upper)):
            if evaluator.built(departure) is None:
                with error_location(note="at a bound of `falsify.vary`"):
                    build(scenario_at(text, box.values(departure)))
        return evaluator


def _required(built: Built, settings: Falsify) -> tuple[Requirement, ...]:
    """What is to be broken."""
    requirements = built.requirements or tuple(
        Requirement(name, below=most) for name, most in built.criterion().items()
    )
    if not requirements:
        hint = "For example `requirements: {settles: {formula: within 10 s always position_error < 0.1}}`"
        raise BadInput("requirements", "be given", hint=hint)
    names = [requirement.name for requirement in requirements]
    for name in settings.requirements or ():
        if name not in names:
            raise BadInput(
                "falsify.requirements", "name requirements of the scenario", name, hint=did_you_mean(name, names)
            )
    if settings.requirements is None:
        return requirements
    return tuple(requirement for requirement in requirements if requirement.name in settings.requirements)


def _check_nominal(evaluator: Evaluator) -> None:
    count = min(len(evaluator.seeds), _NOMINAL)
    least_robustness = evaluator.each(np.zeros((count, len(evaluator.box.axes))), evaluator.seeds[:count]).min(axis=0)
    for requirement, robustness in zip(evaluator.requirements, least_robustness.tolist(), strict=True):
        if not robustness > 0:
            got = f"violated, robustness {robustness:.3g}"
            raise BadInput(
                f"requirements.{requirement.name}", "hold in the nominal scenario", got, hint="Loosen it first"
            )


def _break(
    objective: RobustnessObjective,
    gradient: Callable[[np.ndarray], np.ndarray],
    ends: np.ndarray,
    method: str,
    seed: int,
) -> None:
    """Run the initial design, then descend in the robustness until a requirement breaks."""
    to_break = ToBreak(objective, gradient)
    box = objective.box
    first = np.concatenate([box.to_cube(ends), spread_points(_SPREAD, len(box.axes), seed)])
    try:
        costs = to_break.costs(first)
        order = np.argsort(costs, kind="stable")
        for start in order[:_DESCENTS] if method == "gradient" else ():
            descend(to_break, first[start], float(costs[start]), _ITERATIONS)
        chance = np.random.default_rng([seed, 1])
        for number in itertools.count():  # until a requirement breaks or the budget is spent
            to_break.costs(box.to_cube(_at_bounds(box, _BIASED * 2**number, chance)))
            search(to_break, first[order[0]], _GENERATIONS * 2**number, seed + number)
    except Broken:
        return


def _at_bounds(box: Box, count: int, chance: np.random.Generator) -> np.ndarray:
    """Departures at random, about half of whose numbers are at a bound: failures are often there."""
    shape = (count, len(box.axes))
    inside = box.of_cube(chance.random(shape))
    two_sided = (box.lower < 0) & (box.upper > 0)
    upper = np.where(two_sided, chance.random(shape) < 0.5, box.upper > 0)
    return np.where(chance.random(shape) < 0.5, np.where(upper, box.upper, box.lower), inside)


def as_data(falsified: Falsified) -> dict[str, Any]:
    """Contents of falsify.json."""
    objective, box, violation = falsified.objective, falsified.box, falsified.violation
    least = np.minimum.accumulate(objective.robustnesses)
    departures = [box.values(departure) for departure in objective.departures]
    return {
        "vary": {
            axis.key: {"between": [axis.low, axis.high], "nominal": axis.nominal, "integer": axis.integer}
            for axis in box.axes
        },
        "requirements": [requirement.name for requirement in falsified.evaluator.requirements],
        "method": falsified.method,
        "gradients": "differentiation" if falsified.differentiated else "differences",
        "seed": falsified.seed,
        "seeds": len(falsified.evaluator.seeds),
        "budget": objective.budget,
        "runs": objective.runs,
        "converged": falsified.finished,
        "least_robustness": float(least[-1]) if len(least) else None,
        "counterexample": None
        if violation is None
        else {
            "size": violation.size,
            "values": falsified.values(),
            "seed": violation.seed,
            "departure": dict(zip((axis.key for axis in box.axes), violation.departure.tolist(), strict=True)),
            "robustness": falsified.broken,
            "repeated": falsified.repeated(),
        },
        "history": [
            {"runs": smaller.runs, "size": smaller.size, "robustness": smaller.robustness}
            for smaller in objective.violations
        ],
        "evaluations": {
            "values": {axis.key: [values[axis.key] for values in departures] for axis in box.axes},
            "robustness": objective.robustnesses,
        },
    }
