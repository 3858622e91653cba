"""The adapter for Stable-Baselines3, over its own VecEnv where it is installed, else over one of the same face."""

import sys
import types

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from sitl import SitlError
from sitl.gym.environments import DarkoVectorEnv
from sitl.gym.stable_baselines import stable_baselines_env


class SameFace:
    """The parts of ``stable_baselines3.common.vec_env.VecEnv`` (2.9) that an adapter inherits."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self._reset_seeds()
        self._reset_options()
        self.render_mode = self.get_attr("render_mode")[0]

    def _reset_seeds(self):
        self._seeds = [None] * self.num_envs

    def _reset_options(self):
        self._options = [{}] * self.num_envs

    def _get_indices(self, indices):
        return range(self.num_envs) if indices is None else [indices] if isinstance(indices, int) else indices

    def seed(self, seed):
        self._seeds = [seed + i for i in range(self.num_envs)]

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()


@pytest.fixture
def installed(monkeypatch):
    try:
        import stable_baselines3  # noqa: F401
    except ImportError:
        names = ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")
        for name in names:
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        sys.modules[names[-1]].VecEnv = SameFace


def test_an_episode_that_ends_begins_anew_in_the_same_step(installed):
    env = stable_baselines_env("Hover", 2, max_episode_steps=3)
    env.seed(7)
    first = env.reset()
    vector = DarkoVectorEnv(2, "Hover", max_episode_steps=3)
    assert np.array_equal(first, vector.reset(seed=7)[0])
    for _ in range(2):
        seen, _, ended, infos = env.step(np.zeros((2, 4), np.float32))
        last, *_ = vector.step(np.zeros((2, 4)))
        assert np.array_equal(seen, last)
        assert not ended.any()
        assert infos == [{}, {}]
    seen, rewards, ended, infos = env.step(np.zeros((2, 4), np.float32))
    last, *_ = vector.step(np.zeros((2, 4)))
    assert ended.all()
    assert rewards.dtype == np.float32
    assert np.array_equal(np.stack([info["terminal_observation"] for info in infos]), last)
    assert all(info["TimeLimit.truncated"] for info in infos)
    assert np.array_equal(seen, vector.step(np.zeros((2, 4)))[0])
    assert env.get_attr("max_episode_steps", [0]) == [3]
    env.close()


def test_its_lack_is_told_in_a_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(SitlError, match="pip install stable-baselines3"):
        stable_baselines_env()
