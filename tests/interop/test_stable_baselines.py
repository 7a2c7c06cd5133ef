"""The vector environment as stable-baselines3 takes it, with a stand-in for its base class; precision and size."""

import sys
import types

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.outside import gymnasium as ug

pytestmark = pytest.mark.interop

PENDULUM = {
    "plant": {"kind": "inverted_pendulum", "limit": 30.0},
    "controller": "paper",
    "reference": {"kind": "setpoint", "position": [0.1]},
    "loop": {"duration": 0.01, "dt": 0.001, "record": 0.001},
}
SHOWN = {"float32": True, "normalised": True, "reward": "bounded"}


class VecEnv:
    """What stable-baselines3's base class has, as far as the adapter uses it."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space

    def _get_indices(self, indices):
        return range(self.num_envs) if indices is None else indices

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()


@pytest.fixture
def adapted(monkeypatch):
    module = types.ModuleType("stable_baselines3.common.vec_env")
    module.VecEnv = VecEnv
    for name in ("stable_baselines3", "stable_baselines3.common"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return ug.for_stable_baselines(ug.make_vec(PENDULUM, 3, **SHOWN))


def test_an_episode_that_is_over_begins_anew_in_the_same_step(adapted):
    """No step is lost; the last observation and its reason are in the infos. Against the environments themselves."""
    plain, actions = ug.make_vec(PENDULUM, 3, **SHOWN), np.full((3, 1), 0.5, dtype=np.float32)
    assert adapted.seed(5) == [5, 6, 7]
    first = adapted.reset()
    np.testing.assert_array_equal(first, plain.reset(seed=5)[0])
    for _ in range(9):
        observation, reward, over, infos = adapted.step(actions)
        expected = plain.step(actions)
        np.testing.assert_array_equal(observation, expected[0])
        np.testing.assert_allclose(reward, expected[1], rtol=1e-6)
        assert not over.any() and infos[0] == {"status": "completed", "TimeLimit.truncated": False}
    observation, reward, over, infos = adapted.step(actions)
    last = plain.step(actions)
    assert over.all() and reward.dtype == np.float32
    for number, info in enumerate(infos):
        assert info["TimeLimit.truncated"]
        np.testing.assert_array_equal(info["terminal_observation"], last[0][number])
    np.testing.assert_array_equal(observation, first)  # nothing is random here
    assert not adapted.step(actions)[2].any()
    assert adapted.get_attr("dt", [0, 1]) == [0.001] * 2 and adapted.env_is_wrapped(object) == [False] * 3
    with pytest.raises(BadInput, match="are one program"):
        adapted.set_attr("dt", 1.0)


def test_numbers_are_single_and_of_the_size_of_one():
    """x / (1 + |x|) of errors and velocities, and rewards of 1 / (1 + cost)."""
    plain, shown = ug.make_vec(PENDULUM, 2), ug.make_vec(PENDULUM, 2, **SHOWN)
    assert shown.observation_space.dtype == shown.action_space.dtype == np.float32
    assert plain.observation_space.dtype == np.float64
    assert (shown.observation_space.high == 1).all() and (shown.observation_space.low == -1).all()
    x, y = plain.reset(seed=0)[0], shown.reset(seed=0)[0]
    for k in range(3):
        np.testing.assert_allclose(y[:, :2], x[:, :2] / (1 + np.abs(x[:, :2])), rtol=1e-6)
        np.testing.assert_allclose(y[:, 2:], x[:, 2:], rtol=1e-6)
        actions = np.full((2, 1), 0.3 * k)
        (x, cost, *_), (y, reward, *_) = plain.step(actions), shown.step(actions)
        assert y.dtype == np.float32 and y in shown.observation_space
        np.testing.assert_allclose(reward, 1 / (1 - cost), rtol=1e-12)
    with pytest.raises(BadInput, match="`reward` must be one of negative_cost, bounded, but is huge"):
        ug.make(PENDULUM, reward="huge")


def test_only_a_vector_environment_can_be_adapted():
    with pytest.raises(BadInput, match="`env` must be a vector environment of `make_vec`, but is Env"):
        ug.for_stable_baselines(ug.make(PENDULUM))
