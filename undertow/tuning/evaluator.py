"""Evaluation of gains: many gains on many trials at once, and the gradient of their cost by forward differentiation."""

import concurrent.futures
import dataclasses
import threading
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.analysis.linearization.jacobians import without
from undertow.core import runtime
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractPlant,
    Load,
    ModelScaling,
    Payload,
    Water,
)
from undertow.core.param import Param, param
from undertow.loop import sampled
from undertow.loop.closed_loop import ClosedLoop
from undertow.scenario.schema import Loop, Weights
from undertow.tuning.cost import CostSums, Shares, shares
from undertow.tuning.training_runs import Trials


class Scaled(AbstractDisturbance):
    """`size` times a disturbance: loads and water in proportion, factors on the body as powers."""

    inner: AbstractDisturbance
    size: Float[Param, ""] = param("", "1 leaves the disturbance as it is")

    def realize(self, key):
        return self.inner.realize(key)

    def at(self, realization, t, pose, load: Load) -> Load:
        whole, size = self.inner.at(realization, t, pose, load), self.size
        water, factors = whole.water, whole.scaling
        return Load(
            acceleration=load.acceleration + size * (whole.acceleration - load.acceleration),
            wrench=load.wrench + size * (whole.wrench - load.wrench),
            water=water and Water(size * water.velocity, size * water.acceleration),
            scaling=factors and ModelScaling(*(factor**size for factor in factors)),
            payloads=tuple(Payload(size * each.mass, size * each.weight, each.point) for each in whole.payloads),
        )

    def jumps(self, duration: float) -> tuple[float, ...]:
        return self.inner.jumps(duration)


# Compiling dominates a short tuning; a lower optimisation level halves its time at the same speed.
_COMPILER = {"xla_backend_optimization_level": "1"}

AT_ONCE = 6  # gains per batch
_STEPS = ("resolution", "dead_zone")  # parameters that make a smooth function piecewise constant
_WORKERS = 2


class TrainingLoop(NamedTuple):
    """Everything that stays the same while the gains change."""

    loop: ClosedLoop  # reference, disturbance and navigation; plant and controller are replaced
    settings: Loop
    duration: float  # of every run, s
    start: tuple[Any, Any]  # outputs at t = 0, and their rates
    sums: CostSums
    weights: Weights

    def with_parts(self, plant: AbstractPlant, law: AbstractController, size: Any = 1.0) -> ClosedLoop:
        """The loop with a plant, a controller, and a scaled disturbance."""
        loop = self.loop
        return dataclasses.replace(loop, plant=plant, controller=law, disturbance=Scaled(loop.disturbance, size))

    def run(
        self, law: AbstractController, plant: AbstractPlant, key: Array, size: Float[Array, ""], smooth: bool = False
    ) -> Shares:
        """One run; `smooth` leaves out steps, for a meaningful gradient."""
        loop = self.with_parts(plant, law, size)
        # The derivative of a quantised sensor is zero, as if it were disconnected.
        loop = without(loop, _STEPS) if smooth else loop
        outcome = sampled.simulate(
            loop,
            duration=self.duration,
            dt=self.settings.dt,
            key=key,
            position=self.start[0],
            velocity=self.start[1],
            record_every=0,
            accumulators=(self.sums,),
            method=self.settings.method,
            substeps=self.settings.substeps,
        )
        return shares(outcome.accumulated[0], outcome.ended, self.duration)


class Evaluation:
    """Compiled programs for one training loop and one number of trials per batch.

    Args:
        training_loop: what stays the same.
        make: point -> controller; may be traced.
        like: a controller of that kind, at any point.
        trials: training runs; held-out runs use batches of the same size, so that nothing is compiled twice.
    """

    def __init__(
        self,
        training_loop: TrainingLoop,
        make: Callable[[Any], AbstractController],
        like: AbstractController,
        trials: Trials,
    ):
        self._training_loop, self._training = training_loop, trials
        self._pool, self._lock = runtime.workers(_WORKERS), threading.Lock()
        self._compilers = runtime.workers(_WORKERS)
        self._programs: dict[str, concurrent.futures.Future[Any]] = {}
        self._plant_rest = eqx.filter(trials.plants, eqx.is_array, inverse=True)
        self._law_numbers, self._law_rest = eqx.partition(like, eqx.is_array)
        self._numbers_at = lambda point: eqx.filter(make(point), eqx.is_array)
        self._make = jax.jit(self._numbers_at)

    def law(self, point: np.ndarray) -> AbstractController:
        """The controller of a point, unchecked."""
        return eqx.combine(self._make(jnp.asarray(point)), self._law_rest)

    def costs(self, points: Float[np.ndarray, "p k"]) -> Float[np.ndarray, " p"]:
        """Mean cost of each point over the training runs."""
        return self.total(self.shares([self.law(point) for point in points], self._training)).mean(axis=1)

    def shares(self, laws: Sequence[AbstractController], trials: Trials) -> Shares:
        """Parts of the cost, arrays (laws, trials): in batches of one shape, on both cores."""
        numbers = [self._numbers(law) for law in laws]
        height, width = len(numbers), self._training.number
        rows = [(numbers + numbers[:1] * AT_ONCE)[i : i + AT_ONCE] for i in range(0, height, AT_ONCE)]
        columns = [[min(i + j, trials.number - 1) for j in range(width)] for i in range(0, trials.number, width)]
        stacked = [jax.tree.map(lambda *each: jnp.stack(each), *row) for row in rows]
        batches = [(laws_of_row, trials.part(np.array(column))) for laws_of_row in stacked for column in columns]
        done = list(self._pool.map(lambda batch: self._batch(*batch), batches))
        lines = [done[i : i + len(columns)] for i in range(0, len(done), len(columns))]
        blocks = [jax.tree.map(lambda *pieces: np.concatenate(pieces, axis=1), *line) for line in lines]
        whole = jax.tree.map(lambda *pieces: np.concatenate(pieces, axis=0), *blocks)
        return jax.tree.map(lambda part: part[:height, : trials.number], whole)

    def total(self, parts: Shares) -> np.ndarray:
        """Cost of every run."""
        return np.asarray(parts.cost(self._training_loop.weights))

    def slope(self, point: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Gradient of the mean training cost, by forward differentiation; runs without a finite one count as zero."""
        arguments = self._of_slope(point)
        each = np.asarray(self._compiled("slope", self._slopes, *arguments)(*arguments))
        return np.where(np.isfinite(each), each, 0.0).mean(axis=1)

    def precompile_slope(self, point: Float[np.ndarray, " k"]) -> None:
        """Start to compile the gradient in the background."""
        self._compiling("slope", self._slopes, *self._of_slope(point))

    def _of_slope(self, point: Float[np.ndarray, " k"]) -> tuple[Any, ...]:
        trials = self._training
        return jnp.asarray(point), eqx.filter(trials.plants, eqx.is_array), trials.keys, trials.sizes

    def _slopes(self, point, plants, keys, sizes):
        """Shape (k, trials)."""
        costs = lambda at: self._over_trials(self._numbers_at(at), plants, keys, sizes, True).cost(
            self._training_loop.weights
        )
        along = lambda direction: jax.jvp(costs, (point,), (direction,))[1]
        return jax.vmap(along)(jnp.eye(point.shape[0]))

    def _over_trials(self, law, plants, keys, sizes, smooth: bool = False) -> Shares:
        whole = eqx.combine(law, self._law_rest)
        one = lambda plant, key, size: self._training_loop.run(
            whole, eqx.combine(plant, self._plant_rest), key, size, smooth
        )
        return jax.vmap(one)(plants, keys, sizes)

    def _many(self, laws, plants, keys, sizes) -> Shares:
        return jax.vmap(lambda law: self._over_trials(law, plants, keys, sizes))(laws)

    def _batch(self, laws, trials: Trials) -> Shares:
        arguments = (laws, eqx.filter(trials.plants, eqx.is_array), trials.keys, trials.sizes)
        return jax.tree.map(np.asarray, self._compiled("costs", self._many, *arguments)(*arguments))

    def _numbers(self, law: AbstractController) -> Any:
        """Numbers of a controller in the shapes of the tuned ones: one gain for all axes becomes one per axis."""
        spread = lambda number, like: jnp.broadcast_to(number, like.shape)
        return jax.tree.map(spread, eqx.filter(law, eqx.is_array), self._law_numbers)

    def _compiled(self, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
        return self._compiling(name, function, *arguments).result()

    def _compiling(self, name: str, function: Callable[..., Any], *arguments: Any) -> concurrent.futures.Future[Any]:
        compiled = lambda: jax.jit(function).lower(*arguments).compile(compiler_options=_COMPILER)  # pyright: ignore[reportArgumentType] - options of XLA
        with self._lock:
            if name not in self._programs:
                self._programs[name] = self._compilers.submit(compiled)
            return self._programs[name]
