"""Episodes of any number of vehicles, started and stepped together: what environments of one and of many share."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from undertow.control.controllers.policy_interface import PolicyInterface, policy_interface_of
from undertow.core import checks, runtime
from undertow.core.contracts import Outputs
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.status import Status
from undertow.outside.gymnasium.variants import Vary, variants_of
from undertow.scenario import factory
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read
from undertow.simulation.loop import plant_step
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.outcome import Ending, running
from undertow.simulation.loop.plant_step import PlantState
from undertow.simulation.loop.recording import freeze_on_failure, instant
from undertow.simulation.loop.stepped_batch import CompiledBatchStep, Starter


class QuadraticCost(NamedTuple):
    """Quadratic cost of a step, whose negative is the reward.

    |e_p|^2 / position^2 + |e_a|^2 / angle^2 + effort mean(a^2) + variation mean((a - a_before)^2), with the tracking
    errors e_p and e_a of the true state after the step and the action a as a share of its bound. Where the episode
    fails, `failure` is added once.
    """

    position: float = 1.0  # error with a cost of one, m
    angle: float = 1.0  # rad
    effort: float = 0.01
    variation: float = 0.01
    failure: float = 100.0

    def check(self) -> None:
        """Check the numbers.

        Raises:
            BadInput: a scale is not positive, or a weight is negative.
        """
        for name in ("position", "angle"):
            checks.positive(f"cost.{name}", getattr(self, name))
        for name in ("effort", "variation", "failure"):
            checks.not_negative(f"cost.{name}", getattr(self, name))


class EpisodeSettings(NamedTuple):
    """What all episodes share, and what is not traced."""

    interface: PolicyInterface
    cost: QuadraticCost
    dt: float
    method: str
    substeps: int


class _Known(NamedTuple):
    """Numbers of one episode."""

    loop: ClosedLoop
    start: tuple[Outputs, Outputs]
    key: Any


class _State(NamedTuple):
    """State of one episode."""

    vehicle: PlantState
    action: Any  # the one before
    observation: Any
    step: Any
    ending: Ending


class EpisodeStep(NamedTuple):
    """What a step shows, with a leading axis over episodes."""

    observation: Any
    reward: Any
    status: Any  # a Status code
    position: Any  # true outputs, m and rad
    error: Any  # tracking error of the true state, m and rad


class Episodes:
    """A number of episodes of one scenario that are started and stepped together.

    Args:
        scenario: a .yaml file or an earlier run.nc, the same as a mapping. Its controller is left out.
        count: how many.
        action: what actions mean, see `PolicyInterface`.
        scale: input that a normalised action of 1 stands for, in its unit; None for its limit.
        cost: of a step.
        vary: key path -> distribution, as in campaigns: what differs from episode to episode beside the seed.
        variants: how many sets of varied values there are; an episode takes one of them by its seed.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        interface: meaning of observations and actions.
        steps: of an episode, until its time is over.
        dt: sampling time, s.
        dtype: of observations, by the precision of the scenario.
        backend: `simd` or `xla`.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any],
        count: int,
        action: str = "normalised",
        scale: Any = None,
        cost: QuadraticCost | Mapping[str, float] | None = None,
        vary: Vary | None = None,
        variants: int = 64,
        allow_code: bool = False,
    ):
        text = from_data(scenario) if isinstance(scenario, Mapping) else read(Path(scenario), allow_code=allow_code)
        built = build(text)
        settings = built.scenario.loop
        if settings.kind != "sampled":
            raise BadInput("loop.kind", "be sampled for an environment", settings.kind)
        weights = _cost(cost)
        self.dt = settings.dt
        self.steps = round(settings.duration / settings.dt)
        self._precision = built.scenario.precision
        self.dtype = np.dtype(self._precision)
        with runtime.on_processor(), runtime.in_precision(self._precision):
            model, _ = factory.call(built.closed_loop.plant.model, built.scenario.model.options, folder=text.folder)
            self.interface = policy_interface_of(model, action, scale)
            plan = EpisodeSettings(self.interface, weights, settings.dt, settings.method, settings.substeps)
            built_variants, constant = variants_of(built, vary or {}, variants)
            leaves = [jax.tree.leaves(eqx.filter(variant, eqx.is_array)) for variant in built_variants]
            self._numbers = [np.stack(column) for column in zip(*leaves, strict=True)]
            self._compile(plan, _Known(*built_variants[0], key_of_seed(0)), constant, count)

    def _compile(self, plan: EpisodeSettings, episode: _Known, constant: list[bool], count: int) -> None:
        arrays, static = eqx.partition(episode, eqx.is_array)
        combine = lambda arrays: eqx.combine(arrays, static)
        self._form = jax.tree.structure(arrays)

        def prepare(arrays: Any) -> tuple[Realization, Any]:
            episode = combine(arrays)
            return episode.loop.realize(episode.key), episode.start

        def begin(prepared: tuple[Realization, Any]) -> Any:
            realization, start = prepared
            return eqx.filter(realization, eqx.is_array), _begin(plan, realization, start)

        self._starter = Starter(prepare, begin, arrays, [*constant, False])
        realized, (state, _) = self._starter(jax.tree.map(lambda leaf: np.asarray(leaf)[None], arrays))
        realized, state = jax.tree.map(lambda leaf: leaf[0], (realized, state))
        static_realization = eqx.filter(episode.loop.realize(episode.key), eqx.is_array, inverse=True)
        of_loop = len(jax.tree.leaves(eqx.filter(episode.loop, eqx.is_array)))
        self._same = [*constant[:of_loop], *[False] * (len(jax.tree.leaves(realized)) - of_loop)]
        action = np.asarray(plan.interface.first())
        function = lambda realized, state, action: _step(plan, eqx.combine(realized, static_realization), state, action)
        self._stepper = CompiledBatchStep(function, realized, state, action, count, self._same)
        self.backend = self._stepper.backend

    def start(self, seeds: NDArray, indices: NDArray) -> EpisodeStep:
        """Begin episodes.

        Args:
            seeds: of everything random in them, as `seed` of a scenario; shape (k,).
            indices: of the episodes, shape (k,).
        """
        variant = seeds % len(self._numbers[0])
        numbers = [*(column[variant] for column in self._numbers), _keys(seeds)]
        with runtime.on_processor(), runtime.in_precision(self._precision):
            realized, (state, first_step) = self._starter(jax.tree.unflatten(self._form, numbers))
        varying = [
            leaf for leaf, is_constant in zip(jax.tree.leaves(realized), self._same, strict=True) if not is_constant
        ]
        self._stepper.put("numbers", varying, indices)
        self._stepper.put("state", state, indices)
        return first_step

    def step(self, actions: NDArray) -> EpisodeStep:
        """One step of every episode; those that have failed stay as they are."""
        self._stepper.put("inputs", actions)
        return self._stepper()


def _begin(plan: EpisodeSettings, realization: Realization, start: Any) -> tuple[_State, EpisodeStep]:
    zero = jnp.zeros(())
    action = plan.interface.first()
    vehicle, plant_observation = plant_step.begin(realization, start)
    r = realization.loop.reference.at(zero)
    blank = jnp.concatenate([jnp.zeros(len(plan.interface.bounds())), action])
    observation = _observed(plan, plant_observation.measurement, r, action, blank)
    state = _State(vehicle, action, observation, jnp.zeros((), dtype=int), running())
    error = plan.interface.coordinates.difference(r.position, plant_observation.truth.position)
    return state, EpisodeStep(observation, zero, state.ending.status, plant_observation.truth.position, error)


def _step(plan: EpisodeSettings, realization: Realization, state: _State, action: Any) -> tuple[_State, EpisodeStep]:
    """As `sampled.control_step`, with the command of an action in place of a law's."""
    loop = realization.loop
    dt = jnp.asarray(plan.dt)
    interface = plan.interface
    t = instant(state.step, dt)
    before = state.vehicle
    action = interface.within_bounds(action)
    command = interface.command(action)
    applied = loop.plant.admissible(before.plant, command)
    vehicle = plant_step.hold(realization, before, t, dt, applied, METHODS[plan.method], plan.substeps)
    states = (before.plant, ()), (vehicle.plant, ())
    (x, _), ending = freeze_on_failure(loop, *states, state.ending, t, dt, command)
    now = instant(state.step + 1, dt)
    vehicle, plant_observation = plant_step.observe(realization, vehicle._replace(plant=x), now, applied)
    r = loop.reference.at(now)
    observation = _observed(plan, plant_observation.measurement, r, action, state.observation)
    error = interface.coordinates.difference(r.position, plant_observation.truth.position)
    failing = (ending.status != int(Status.OK)) & (state.ending.status == int(Status.OK))
    reward = -_cost_of(plan, error, action, state.action) - plan.cost.failure * failing.astype(float)
    new = _State(vehicle, action, observation, state.step + 1, ending)
    return new, EpisodeStep(observation, reward, ending.status, plant_observation.truth.position, error)


def _observed(plan: EpisodeSettings, y: Any, r: Any, action: Any, before: Any) -> Any:
    """The observation; entries that are not finite were not measured, and are those of the observation before."""
    observation = plan.interface.observation(y, r, action)
    return jnp.where(jnp.isfinite(observation), observation, before)


def _cost_of(plan: EpisodeSettings, error: Any, action: Any, before: Any) -> Any:
    low, high = map(jnp.asarray, plan.interface.action_bounds())
    size = jnp.maximum(-low, high)
    used, changed = ((part / size) ** 2 for part in (action, action - before))
    turns = np.array(plan.interface.coordinates.angles, dtype=bool)
    scales = jnp.asarray(np.where(turns, plan.cost.angle, plan.cost.position))
    return ((error / scales) ** 2).sum() + plan.cost.effort * used.mean() + plan.cost.variation * changed.mean()


def _cost(settings: Any) -> QuadraticCost:
    if isinstance(settings, Mapping):
        if unknown := set(settings) - set(QuadraticCost._fields):
            raise BadInput(
                "cost", f"have the keys {', '.join(QuadraticCost._fields)}", ", ".join(sorted(map(str, unknown)))
            )
        settings = QuadraticCost(**settings)
    cost = QuadraticCost() if settings is None else settings
    cost.check()
    return cost


def _keys(seeds: NDArray) -> NDArray:
    """`key_of_seed` of many seeds of 32 bits: (0, seed)."""
    return np.stack([np.zeros_like(seeds), seeds], axis=1).astype(np.uint32)
