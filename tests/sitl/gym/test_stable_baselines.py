"""The adapter for Stable-Baselines3, over its own VecEnv where it is installed, else over one of the same face."""

import sys
import types

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from sitl import SitlError
from sitl.gym.environments import DarkoVectorEnv
from sitl.gym.stable_baselines import stable_baselines_env

MODULES = ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")


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
        for name in MODULES:
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        sys.modules[MODULES[-1]].VecEnv = SameFace


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


@pytest.mark.long
def test_an_algorithm_of_its_own_learns_repeatably_and_is_judged_and_kept(tmp_path):
    baselines = pytest.importorskip("stable_baselines3")  # brings torch, of 5 GB
    import gymnasium
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    check_env(gymnasium.make("DarkO/Hover-v0", max_episode_steps=10).unwrapped)

    def learnt():
        env = VecNormalize(VecMonitor(stable_baselines_env("Hover", 4, max_episode_steps=50)))
        agent = baselines.PPO("MlpPolicy", env, n_steps=64, batch_size=64, seed=3, device="cpu")
        return agent.learn(512)

    first, again = learnt(), learnt()
    weights = first.get_parameters()["policy"]
    assert all((value == again.get_parameters()["policy"][name]).all() for name, value in weights.items())
    first.save(tmp_path / "agent.zip")
    kept = baselines.PPO.load(tmp_path / "agent.zip")
    judged = VecMonitor(stable_baselines_env("Hover", 4, max_episode_steps=50))
    returns, lengths = evaluate_policy(kept, judged, n_eval_episodes=8, return_episode_rewards=True)
    assert len(returns) == 8
    assert max(lengths) == 50
    assert 0.0 < np.mean(returns) < 1.0  # of a second at most


def test_its_lack_is_told_in_a_line(monkeypatch):
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SitlError, match="pip install stable-baselines3"):
        stable_baselines_env()
