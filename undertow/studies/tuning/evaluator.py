"""Evaluation of gains: many gains on many trials at once, and the gradient of their cost by differences."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import runtime
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractPlant,
    FreeSurface,
    Load,
    ModelScaling,
    Payload,
    Water,
)
from undertow.core.param import Param, param
from undertow.scenario.schema import ClosedLoopSettings, Weights
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.prepared_run import PreparedRun, RunBatch
from undertow.simulation.programs import ProgramCache
from undertow.simulation.run_many import BatchResult, in_order, run_many
from undertow.studies.tuning.cost import CostSums, Shares, shares
from undertow.studies.tuning.training_runs import PlantVariants, joined


class Scaled(AbstractDisturbance):
    """`size` times a disturbance: loads and water in proportion, factors on the body as powers."""

    inner: AbstractDisturbance
    size: Float[Param, ""] = param("", "1 leaves the disturbance as it is")

    def realize(self, key):
        return self.inner.realize(key)

    def at(self, realization, t, pose, load: Load) -> Load:
        full = self.inner.at(realization, t, pose, load)
        size = self.size
        water, factors, surface = full.water, full.scaling, full.surface
        return Load(
            acceleration=load.acceleration + size * (full.acceleration - load.acceleration),
            wrench=load.wrench + size * (full.wrench - load.wrench),
            water=water and Water(size * water.velocity, size * water.acceleration),
            scaling=factors and ModelScaling(*(factor**size for factor in factors)),
            payloads=tuple(
                Payload(size * payload.mass, size * payload.weight, payload.point) for payload in full.payloads
            ),
            surface=surface and FreeSurface(surface.depth, size * surface.elevation),
        )

    def jumps(self, duration: float) -> tuple[float, ...]:
        return self.inner.jumps(duration)


AT_ONCE = 6  # gains per batch
_WORKERS = 2

# Of a variable, for the central differences of the cost; the box is 1 wide. Quantised readings and dead zones make
# small steps in the cost, which a shorter difference would take for a slope.
_DIFFERENCE = 1e-3


class TrainingLoop(NamedTuple):
    """Everything that stays the same while the gains change."""

    loop: ClosedLoop  # reference, disturbance and navigation; plant and controller are replaced
    settings: ClosedLoopSettings
    duration: float  # of every run, s
    start: tuple[Any, Any]  # outputs at t = 0, and their rates
    sums: CostSums
    weights: Weights

    def with_parts(self, plant: AbstractPlant, law: AbstractController, size: Any = 1.0) -> ClosedLoop:
        """The loop with a plant, a controller, and a scaled disturbance."""
        loop = self.loop
        return dataclasses.replace(loop, plant=plant, controller=law, disturbance=Scaled(loop.disturbance, size))

    def run(self, law: AbstractController, plant: AbstractPlant, key: Array, size: Float[Array, ""]) -> LoopRun:
        """One run."""
        loop = self.with_parts(plant, law, size)
        return LoopRun(loop, (self.sums,), loop.outputs_at_start(*self.start), key)

    def plan(self) -> RunPlan:
        """Steps and integration of every run; nothing is recorded."""
        settings = self.settings
        steps = round(self.duration / settings.dt)
        return RunPlan(steps, settings.dt, 0, (), settings.method, settings.substeps)


class Evaluation:
    """The program of the runs of one training loop, made when it is first needed.

    Numbers that are equal in all examples are expected to be so in all runs (see `ProgramCache`).

    Args:
        training_loop: what stays the same.
        make: point -> controller; may be traced.
        examples: controllers of that kind that differ in all numbers that are tuned.
        trials: sets of runs on which gains are evaluated, the training runs first.
    """

    def __init__(
        self,
        training_loop: TrainingLoop,
        make: Callable[[Any], AbstractController],
        examples: Sequence[AbstractController],
        trials: Sequence[PlantVariants],
    ):
        self._training_loop, self._training = training_loop, trials[0]
        self._law_numbers, self._law_rest = eqx.partition(examples[0], eqx.is_array)
        self._make = jax.jit(lambda point: eqx.filter(make(point), eqx.is_array))
        first = self._training.part(np.array([0]))
        plant = jax.tree.map(lambda leaf: leaf[0] if eqx.is_array(leaf) else leaf, first.plants)
        run = training_loop.run(examples[0], plant, first.keys[0], first.sizes[0])
        backend = training_loop.settings.backend
        self._first = PreparedRun(run, training_loop.plan(), backend, runtime.current_precision())
        self._examples = self._batch(examples, joined(trials))
        self._programs = ProgramCache(lambda: [self._examples], xla_width=self._width)

    def law(self, point: np.ndarray) -> AbstractController:
        """The controller of a point, unchecked."""
        return eqx.combine(self._make(jnp.asarray(point)), self._law_rest)

    def costs(self, points: Float[np.ndarray, "p k"]) -> Float[np.ndarray, " p"]:
        """Mean cost of each point over the training runs."""
        return self.total(self.shares([self.law(point) for point in points], self._training)).mean(axis=1)

    def shares(self, laws: Sequence[AbstractController], trials: PlantVariants) -> Shares:
        """Parts of the cost, arrays (laws, trials), on both cores."""
        batch = self._batch(laws, trials)
        results = list(run_many([batch], programs=self._programs, workers=_WORKERS, at_once=self._width))
        parts = in_order(results, [self._shares(result) for result in results])
        return jax.tree.map(lambda part: part.reshape(len(laws), trials.number), parts)

    def compile(self) -> None:
        """Make the program now."""
        (group,) = self._programs.groups([self._examples])
        self._programs.runner(group)

    def total(self, parts: Shares) -> np.ndarray:
        """Cost of every run."""
        return np.asarray(parts.cost(self._training_loop.weights))

    def slope(self, point: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Gradient of the mean training cost by central differences, one-sided at a bound."""
        steps = _DIFFERENCE * np.eye(len(point))
        ahead, behind = (np.clip(point + side * steps, 0.0, 1.0) for side in (1.0, -1.0))
        costs = self.costs(np.concatenate([ahead, behind]))
        return (costs[: len(point)] - costs[len(point) :]) / np.diagonal(ahead - behind)

    @property
    def _width(self) -> int:
        """Runs that are computed together."""
        return AT_ONCE * self._training.number

    def _shares(self, result: BatchResult) -> Shares:
        ended = jnp.asarray(result.outcome.ended)
        parts = shares(result.outcome.accumulated[0], ended, self._training_loop.duration)
        return jax.tree.map(np.asarray, parts)

    def _batch(self, laws: Sequence[AbstractController], trials: PlantVariants) -> RunBatch:
        """Runs of every law on every trial."""
        runs = len(laws) * trials.number
        of_laws = lambda *leaves: np.repeat(np.stack(leaves), trials.number, axis=0)
        of_trials = lambda leaf: np.concatenate([np.asarray(leaf)] * len(laws))
        of_all = lambda leaf: np.broadcast_to(np.asarray(leaf), (runs, *leaf.shape))
        varying = (
            jax.tree.map(of_trials, eqx.filter(trials.plants, eqx.is_array)),
            jax.tree.map(of_laws, *(self._numbers(law) for law in laws)),
            of_trials(trials.sizes),
            of_trials(trials.keys),
        )
        same = jax.tree.map(of_all, eqx.filter(self._first.run, eqx.is_array))
        places = lambda run: (run.loop.plant, run.loop.controller, run.loop.disturbance.size, run.key)
        return RunBatch(self._first, jax.tree.leaves(eqx.tree_at(places, same, varying)), runs)

    def _numbers(self, law: AbstractController) -> Any:
        """Numbers of a controller in the shapes of the tuned ones: one gain for all axes becomes one per axis."""
        spread = lambda number, like: np.broadcast_to(np.asarray(number), like.shape)
        return jax.tree.map(spread, eqx.filter(law, eqx.is_array), self._law_numbers)
