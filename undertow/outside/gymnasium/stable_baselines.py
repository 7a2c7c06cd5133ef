"""A vector environment as stable-baselines3 takes it, which is not that of Gymnasium."""

import importlib
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.gymnasium.vector_env import VectorEnv


def for_stable_baselines(env: VectorEnv) -> Any:
    """The environments as a `VecEnv` of stable-baselines3, which has to be installed.

    An environment whose episode is over begins anew within the same step; its last observation is
    `infos[i]["terminal_observation"]`, and `infos[i]["TimeLimit.truncated"]` tells the end of the time from a failure.

    Raises:
        BadInput: it is no vector environment.
        ModuleNotFoundError: stable-baselines3 is not installed.
    """
    if not isinstance(env, VectorEnv):
        raise BadInput("env", "be a vector environment of `make_vec`", type(env).__name__)
    base: Any = importlib.import_module("stable_baselines3.common.vec_env").VecEnv

    class StableBaselinesVecEnv(base):
        """Of `for_stable_baselines`."""

        def __init__(self) -> None:
            self.vector = env
            self._seeds = None
            self.reset_infos = [{} for _ in range(env.num_envs)]
            super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

        def seed(self, seed: int | None = None) -> list[int | None]:
            """Seed of the next `reset`; environment i has seed + i."""
            self._seeds = seed
            return [None if seed is None else seed + number for number in range(self.num_envs)]

        def reset(self) -> Any:
            observation, _ = self.vector.reset(seed=self._seeds)
            self._seeds = None
            return observation

        def step_async(self, actions: Any) -> None:
            self._actions = actions

        def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
            observation, reward, terminated, truncated, info = self.vector.step(self._actions)
            over = terminated | truncated
            infos: list[dict[str, Any]] = [
                {"status": Status(int(code)).word, "TimeLimit.truncated": bool(late)}
                for code, late in zip(info["status"], truncated, strict=True)
            ]
            if over.any():
                for number in np.flatnonzero(over):
                    infos[number]["terminal_observation"] = observation[number].copy()
                observation, _ = self.vector.reset(options={"reset_mask": over})
            return observation, reward.astype(np.float32), over, infos

        def close(self) -> None:
            self.vector.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(self.vector, attr_name)] * len(list(self._get_indices(indices)))

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise BadInput(attr_name, "stay as it is: the environments are one program")

        def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **options: Any) -> list[Any]:
            raise BadInput(method_name, "not be called on single environments: they are one program")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * len(list(self._get_indices(indices)))

    return StableBaselinesVecEnv()
