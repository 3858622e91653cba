"""The environments of gymnasium: one flight, and a vector of them stepped by one compiled call.

Both are made of :class:`~sitl.gym.flight_batch.FlightBatch`, so that flight ``i`` of a vector that is reset with seed s
is to the bit the single environment that is reset with seed s + i.
"""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from sitl.errors import SitlError
from sitl.gym.action_kinds import ACTED
from sitl.gym.flight_batch import BatchOptions, FlightBatch
from sitl.gym.pictures import FlightPicture
from sitl.gym.rewards import MOST_OBSERVED, OBSERVED

RENDERED: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # metadata of both
Observation = npt.NDArray[np.float32]


def _spaces() -> tuple[Any, Any]:
    bound = np.float32(MOST_OBSERVED)
    return spaces.Box(-bound, bound, (OBSERVED,), np.float32), spaces.Box(-1.0, 1.0, (ACTED,), np.float32)


class DarkoEnv(gymnasium.Env[Observation, npt.NDArray[np.float32]]):
    """One flight of a task; see docs/gym.md.

    Args:
        task: Hover, Transition, Leg, Fall or Gust.
        render_mode: ``rgb_array`` or None.
        options: Of :class:`~sitl.gym.flight_batch.BatchOptions`.

    Raises:
        SitlError: If an option is not usable.
    """

    metadata: ClassVar[dict[str, Any]] = RENDERED  # type: ignore[misc]

    def __init__(self, task: str = "Hover", *, render_mode: str | None = None, **options: Any) -> None:  # noqa: ANN401
        self.batch = FlightBatch(task, 1, batch_options(options))
        self.observation_space, self.action_space = _spaces()
        self.render_mode = checked_mode(render_mode)
        self._picture = FlightPicture()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; there are no options."""
        super().reset(seed=seed, options=options)
        self.batch.begin([0], [self.np_random])
        self._picture.begin(self.batch, 0)
        return self.batch.look()[0], {}

    def step(self, action: npt.NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly an interval; an episode that is lost is terminated, time limits are the wrapper's.

        Raises:
            SitlError: If the action is not four finite numbers.
        """
        seen = self.batch.step(np.reshape(action, (1, -1)), np.ones(1, bool))
        if self.render_mode is not None:
            self._picture.follow(self.batch, 0)
        return seen.observations[0], float(seen.rewards[0]), bool(seen.lost[0]), False, {}

    def render(self) -> npt.NDArray[np.uint8] | None:
        """The flight so far from the side and from above, (height, width, 3)."""
        return None if self.render_mode is None else self._picture.draw(self.batch, 0)

    def close(self) -> None:
        """Nothing is left open."""
        self.batch.close()


class DarkoVectorEnv(VectorEnv[Observation, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """Many flights of a task; an episode that has ended begins anew in the next step.

    Args:
        num_envs: How many.
        task: Hover, Transition, Leg, Fall or Gust.
        max_episode_steps: After which an episode is cut off; the task's own by default.
        render_mode: ``rgb_array`` or None.
        options: Of :class:`~sitl.gym.flight_batch.BatchOptions`.

    Raises:
        SitlError: If an option is not usable.
    """

    metadata: ClassVar[dict[str, Any]] = RENDERED | {"autoreset_mode": AutoresetMode.NEXT_STEP}  # type: ignore[misc]

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "Hover",
        *,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **options: Any,  # noqa: ANN401
    ) -> None:
        self.batch = FlightBatch(task, num_envs, batch_options(options))
        self.num_envs, self.render_mode = num_envs, checked_mode(render_mode)
        self.max_episode_steps = max_episode_steps or self.batch.max_steps
        self.single_observation_space, self.single_action_space = _spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms = [np.random.default_rng()] * num_envs
        self._is_seeded = False
        self._steps = np.zeros(num_envs, int)
        self._ended = np.zeros(num_envs, bool)
        self._pictures = [FlightPicture() for _ in range(num_envs if render_mode is not None else 0)]

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - of gymnasium
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin all episodes.

        Args:
            seed: Flight i is seeded by ``seed + i``, or by item i of a list.
            options: There are none.
        """
        if seed is not None or not self._is_seeded:
            numbers = range(self.num_envs)
            seeds = seed if isinstance(seed, list) else [None if seed is None else seed + i for i in numbers]
            if len(seeds) != self.num_envs:
                raise SitlError(f"{len(seeds)} seeds for {self.num_envs} environments")
            self._randoms = [
                seeding.np_random(own)[0] if own is not None or not self._is_seeded else self._randoms[i]
                for i, own in enumerate(seeds)
            ]
            self._is_seeded = True
        self._begin(np.arange(self.num_envs))
        return self.batch.look(), {}

    def step(
        self, actions: npt.NDArray[np.float32]
    ) -> tuple[Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Fly an interval; flights that had ended begin anew instead, with reward 0.

        Raises:
            SitlError: If the actions are not four finite numbers for each.
        """
        flies = ~self._ended
        if self._ended.any():
            self._begin(np.flatnonzero(self._ended))
        seen = self.batch.step(actions, flies)
        self._steps += flies
        terminated, truncated = seen.lost.copy(), self._steps >= self.max_episode_steps
        self._ended = terminated | truncated
        for i, picture in enumerate(self._pictures):
            picture.follow(self.batch, i)
        return seen.observations, seen.rewards.copy(), terminated, truncated, {}

    def begin_ended(self) -> Observation:
        """Begin the episodes that have ended at once, for callers that do not wait for the next step.

        Returns:
            Observations of all, (n, OBSERVED).
        """
        self._begin(np.flatnonzero(self._ended))
        return self.batch.look()

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """A picture of each flight so far."""
        if self.render_mode is None:
            return None
        return tuple(picture.draw(self.batch, i) for i, picture in enumerate(self._pictures))

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ANN401, ARG002 - of gymnasium
        """End the threads."""
        self.batch.close()

    def _begin(self, which: npt.NDArray[np.int64]) -> None:
        self.batch.begin(which.tolist(), [self._randoms[i] for i in which])
        self._steps[which], self._ended[which] = 0, False
        for i in which if self._pictures else ():
            self._pictures[i].begin(self.batch, i)


def batch_options(options: dict[str, Any]) -> BatchOptions:
    """Options by name.

    Raises:
        SitlError: If one is not known.
    """
    if unknown := sorted(options.keys() - set(BatchOptions._fields)):
        raise SitlError(f"option {unknown[0]!r}: there is {', '.join(BatchOptions._fields)}")
    return BatchOptions(**options)


def checked_mode(mode: str | None) -> str | None:
    """A render mode that there is.

    Raises:
        SitlError: If there is none of this name.
    """
    if mode not in {None, "rgb_array"}:
        raise SitlError(f"render_mode {mode!r}: there is rgb_array")
    return mode
