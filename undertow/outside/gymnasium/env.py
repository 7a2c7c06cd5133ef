"""One vehicle as an environment of Gymnasium."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.gymnasium.agent_interface import agent_interface
from undertow.outside.gymnasium.episodes import Episodes, EpisodeStep, QuadraticCost
from undertow.outside.gymnasium.variants import Vary
from undertow.simulation.loop.stepped import Uncopied

_SEEDS = 2**32  # of runs


class Env(Uncopied, gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """A vehicle, or another plant, whose inputs an agent chooses at every sampling time.

    Observations and actions are described at `PolicyInterface`, the reward at `QuadraticCost`. An episode is
    `terminated` where the run fails (it diverges, a state is not finite, ...; `info["status"]` says which) and
    `truncated` at the duration of the scenario. `reset(seed=n)` begins the run that the scenario has with `seed: n`;
    without a seed the next one follows from the one before.

    Arguments are those of `Episodes`, without `count`, and how numbers are shown (see `AgentInterface`): `float32`
    whatever the precision of the scenario, `normalised` observations, and the `reward`.
    """

    _instead = "Make another one, `reset` it with the same seed, and give it the same actions"
    metadata = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any],
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
            hint = "`undertow simulate` writes figures and a replay of the same run under a controller"
            raise BadInput("render_mode", "be None", render_mode, hint=hint)
        self._episodes = Episodes(scenario, 1, action, scale, cost, vary, variants, allow_code)
        self.interface, self.dt = self._episodes.interface, self._episodes.dt
        self._shown = agent_interface(self.interface, self._episodes.dtype, float32, normalised, reward)
        self.observation_space, self.action_space = self._shown.spaces()
        self._step, self._over = 0, True

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        """Begin an episode; see the class."""
        super().reset(seed=seed)
        run = int(self.np_random.integers(_SEEDS)) if seed is None else seed % _SEEDS
        first_step = self._episodes.start(np.array([run]), np.array([0]))
        self._step, self._over = 0, False
        return self._shown.observation(first_step.observation[0]), info_of(first_step, 0) | {"seed": run}

    def step(self, action: NDArray[Any]):
        """Hold an action for one sampling time."""
        if self._over:
            raise BadInput("reset", "be called before `step`", "not")
        checked_action = actions_of(action, (self.interface.actions,))
        result = self._episodes.step(checked_action[None])
        self._step += 1
        terminated = bool(result.status[0] != Status.OK)
        truncated = not terminated and self._step >= self._episodes.steps
        self._over = terminated or truncated
        observation = self._shown.observation(result.observation[0])
        reward = float(self._shown.rewards(result.reward[0]))
        return observation, reward, terminated, truncated, info_of(result, 0)


def make(scenario: str | Path | Mapping[str, Any], **options: Any) -> Env:
    """An environment of a scenario; `options` are those of `Env`."""
    return Env(scenario, **options)


def actions_of(actions: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Actions as numbers.

    Raises:
        BadInput: they have another shape, or are not finite.
    """
    try:
        values = np.asarray(actions, dtype=float)
    except (TypeError, ValueError):
        raise BadInput("action", "be numbers", repr(actions)) from None
    if values.shape != shape:
        raise BadInput("action", f"have shape {shape}", f"of shape {values.shape}")
    if not np.isfinite(values).all():
        raise BadInput("action", "be finite", "not")
    return values


def info_of(result: EpisodeStep, number: int) -> dict[str, Any]:
    """What the agent does not observe: true outputs, tracking error, and the status of the run."""
    status = Status(int(result.status[number]))
    return {"position": result.position[number], "error": result.error[number], "status": status.word}
