"""Many vehicles as one vector environment of Gymnasium, stepped as one program."""

from collections.abc import Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import vector
from gymnasium.utils import seeding
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.gymnasium.agent_interface import agent_interface
from undertow.outside.gymnasium.env import actions_of
from undertow.outside.gymnasium.episodes import Episodes, EpisodeStep, QuadraticCost
from undertow.outside.gymnasium.variants import Vary
from undertow.simulation.loop.stepped import Uncopied

_SEEDS = 2**32  # of runs


class VectorEnv(Uncopied, vector.VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """`num_envs` environments of one scenario, each with the bits of an `Env` by itself.

    An environment whose episode is over is reset by the next step, which ignores its action and has reward zero
    (`AutoresetMode.NEXT_STEP`). `reset(seed=n)` gives environment i the seed n + i, a list of seeds each its own;
    afterwards each goes on with its own generator, as an `Env` does.

    Arguments are those of `Env`.
    """

    _instead = "Make another one, `reset` it with the same seeds, and give it the same actions"
    metadata = {"render_modes": [], "autoreset_mode": vector.AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any],
        num_envs: int = 1,
        *,
        action: str = "normalised",
        scale: Any = None,
        cost: QuadraticCost | Mapping[str, float] | None = None,
        vary: Vary | None = None,
        variants: int = 64,
        allow_code: bool = False,
        float32: bool = False,
        normalised: bool = False,
        reward: str = "negative_cost",
        render_mode: None = None,
    ):
        if render_mode is not None:
            raise BadInput("render_mode", "be None", render_mode)
        if not isinstance(num_envs, int) or num_envs < 1:
            raise BadInput("num_envs", "be a positive integer", num_envs)
        self._episodes = Episodes(scenario, num_envs, action, scale, cost, vary, variants, allow_code)
        self.interface, self.dt, self.num_envs = self._episodes.interface, self._episodes.dt, num_envs
        self._shown = agent_interface(self.interface, self._episodes.dtype, float32, normalised, reward)
        self.single_observation_space, self.single_action_space = self._shown.spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [seeding.np_random(None)[0] for _ in range(num_envs)]
        self._steps, self._over = np.zeros(num_envs, dtype=int), np.zeros(num_envs, dtype=bool)
        self._started = False

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None):
        """Begin an episode of every environment, or of those in `options["reset_mask"]`; see the class."""
        indices = self._chosen(options)
        seeds = self._seeds_of(seed)
        super().reset(seed=int(seed) if isinstance(seed, Integral) else None)
        runs = np.array([self._run(number, seeds[number]) for number in indices.tolist()], dtype=np.uint32)
        if not self._started:
            self._observation = np.zeros(self.observation_space.shape or (), self._shown.dtype)
        first_step = self._episodes.start(runs, indices)
        self._observation[indices] = self._shown.observation(first_step.observation)
        self._steps[indices], self._over[indices], self._started = 0, False, True
        return self._observation.copy(), self._info(first_step, indices) | self._of("seed", runs, indices)

    def step(self, actions: NDArray[Any]):
        """Hold an action for one sampling time in every environment, and reset those whose episode is over."""
        if not self._started:
            raise BadInput("reset", "be called before `step`", "not")
        checked_actions = actions_of(actions, (self.num_envs, self.interface.actions))
        renewed = np.flatnonzero(self._over)
        result = self._episodes.step(checked_actions)
        self._steps += 1
        if len(renewed):
            runs = np.array([self._run(number, None) for number in renewed.tolist()], dtype=np.uint32)
            for values, new in zip(result, self._episodes.start(runs, renewed), strict=True):
                values[renewed] = new
            self._steps[renewed] = 0
        terminated = result.status != Status.OK
        truncated = ~terminated & (self._steps >= self._episodes.steps)
        self._over, self._observation = terminated | truncated, self._shown.observation(result.observation)
        rewards = self._shown.rewards(result.reward)
        rewards[renewed] = 0.0
        all_indices = np.arange(self.num_envs)
        return self._observation.copy(), rewards, terminated, truncated, self._info(result, all_indices)

    def _chosen(self, options: dict[str, Any] | None) -> NDArray[Any]:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.arange(self.num_envs)
        if np.shape(mask) != (self.num_envs,) or np.asarray(mask).dtype != bool:
            raise BadInput("reset_mask", f"be {self.num_envs} booleans", f"of shape {np.shape(mask)}")
        if not (self._started or np.all(mask)):
            raise BadInput("reset_mask", "choose all environments the first time", "fewer")
        return np.flatnonzero(mask)

    def _seeds_of(self, seed: Any) -> list[int | None]:
        if seed is None or isinstance(seed, Integral):
            return [None if seed is None else int(seed) + number for number in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise BadInput("seed", f"be one, or {self.num_envs} of them", f"{len(seed)} of them")
        return list(seed)

    def _run(self, number: int, seed: int | None) -> int:
        """Seed of the next episode of an environment."""
        if seed is None:
            return int(self._generators[number].integers(_SEEDS))
        self._generators[number], _ = seeding.np_random(seed)
        return seed % _SEEDS

    def _info(self, result: EpisodeStep, indices: NDArray[Any]) -> dict[str, Any]:
        info: dict[str, Any] = {}
        for name in ("position", "error", "status"):
            info |= self._of(name, getattr(result, name), indices)
        return info

    def _of(self, name: str, values: NDArray[Any], indices: NDArray[Any]) -> dict[str, Any]:
        """Values of some environments as Gymnasium has them: an array over all, and which of them it holds."""
        values_of_all = np.zeros((self.num_envs, *values.shape[1:]), dtype=values.dtype)
        values_of_all[indices] = values
        is_held = np.zeros(self.num_envs, dtype=bool)
        is_held[indices] = True
        return {name: values_of_all, f"_{name}": is_held}


def make_vec(scenario: str | Path | Mapping[str, Any], num_envs: int = 1, **options: Any) -> VectorEnv:
    """A vector environment of a scenario; `options` are those of `VectorEnv`."""
    return VectorEnv(scenario, num_envs, **options)
