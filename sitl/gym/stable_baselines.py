"""The vector environment as Stable-Baselines3 takes one: its own VecEnv, whose episodes begin anew in the same step.

Stable-Baselines3 is no dependency: ``pip install stable-baselines3``, which brings torch.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from sitl.errors import SitlError
from sitl.gym.environments import DarkoVectorEnv


def stable_baselines_env(task: str = "Hover", num_envs: int = 8, **options: Any) -> Any:  # noqa: ANN401 - not installed
    """A ``stable_baselines3.common.vec_env.VecEnv`` of a task.

    Args:
        task: Hover, Transition, Leg, Fall or Gust.
        num_envs: How many flights.
        options: As of :class:`~sitl.gym.environments.DarkoVectorEnv`.

    Raises:
        SitlError: If Stable-Baselines3 is missing, or an option is not usable.
    """
    try:
        from stable_baselines3.common.vec_env import VecEnv  # noqa: PLC0415 - loads torch
    except ImportError as error:
        raise SitlError("Stable-Baselines3 is missing: pip install stable-baselines3") from error
    adapter: Any = type("DarkoVecEnv", (VecEnvMethods, VecEnv), {})
    return adapter(DarkoVectorEnv(num_envs, task, **options))


class VecEnvMethods:
    """The methods of a ``VecEnv``, by a vector of flights; put before that class, which is loaded when it is asked for.

    Args:
        vector: The flights.
    """

    def __init__(self, vector: DarkoVectorEnv) -> None:
        self.vector, base = vector, cast("Any", super())
        self._actions: Any = None
        base.__init__(vector.num_envs, vector.single_observation_space, vector.single_action_space)

    def reset(self) -> Any:  # noqa: ANN401
        """Begin all episodes, by the seeds that were given."""
        base: Any = self
        seeds = [None if seed is None else int(seed) for seed in base._seeds]  # noqa: SLF001 - VecEnv's, for adapters
        seen, _ = self.vector.reset(seed=seeds if any(seed is not None for seed in seeds) else None)
        base._reset_seeds()  # noqa: SLF001 - likewise
        base._reset_options()  # noqa: SLF001 - likewise
        return seen

    def step_async(self, actions: Any) -> None:  # noqa: ANN401
        """Take the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        """Fly an interval; what has ended begins anew, its last observation is in its info."""
        seen, rewards, lost, cut, _ = self.vector.step(self._actions)
        ended = lost | cut
        infos: list[dict[str, Any]] = [{} for _ in ended]
        for i in np.flatnonzero(ended):
            is_cut = bool(cut[i] and not lost[i])
            infos[i] = {"terminal_observation": seen[i].copy(), "TimeLimit.truncated": is_cut}
        if ended.any():
            seen = self.vector.begin_ended()
        return seen, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        """End the threads."""
        self.vector.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:  # noqa: ANN401
        """An attribute of the vector, for each flight."""
        return [getattr(self.vector, attr_name)] * self._count(indices)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:  # noqa: ANN401, ARG002
        """Set an attribute of the vector."""
        setattr(self.vector, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:  # noqa: ANN401
        """Call a method of the vector once; its result, for each flight."""
        return [getattr(self.vector, method_name)(*args, **kwargs)] * self._count(indices)

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:  # noqa: ANN401, ARG002
        """No flight is wrapped."""
        return [False] * self._count(indices)

    def get_images(self) -> Sequence[Any]:
        """A picture of each flight."""
        return self.vector.render() or ()

    def _count(self, indices: Any) -> int:  # noqa: ANN401 - None, a number or several
        return self.vector.num_envs if indices is None else np.size(indices)
