"""Policies beside our own controllers: episodes flown, returns compared, and linear policies kept in files."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from sitl.defaults import CONTROLLER_NAMES
from sitl.errors import SitlError
from sitl.gym.action_kinds import ACTED
from sitl.gym.flight_batch import BatchOptions, FlightBatch
from sitl.gym.rewards import CRUISE_NORTH, OBSERVED
from sitl.model.airframe import Array

TRAINED = Path(__file__).parent / "trained"
MEAN_DEVIATIONS = 1.96  # deviations of a mean on either side, 95 %
Act = Callable[[npt.NDArray[np.float32]], Array]


class Returns(NamedTuple):
    """Result of one episode in each flight of a batch."""

    returns: Array  # (n,) sums of rewards
    lost: npt.NDArray[np.bool_]  # (n,)
    seconds: Array  # (n,) until the end
    off: Array  # (n,) from the place in the end; of a cruise: from its line [m]

    @property
    def mean(self) -> float:
        """Mean return."""
        return float(self.returns.mean())

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval of the mean."""
        n = len(self.returns)
        return MEAN_DEVIATIONS * float(self.returns.std(ddof=1)) / math.sqrt(n) if n > 1 else math.inf


class LinearPolicy(NamedTuple):
    """Actions are ``weights @ observation + offset``, cut to -1 and 1; and what it was trained for."""

    task: str
    actions: str
    observe: str
    weights: Array  # (4, OBSERVED)
    offset: Array  # (4,)
    seed: int = 0  # of the training
    curve: tuple[float, ...] = ()  # mean return by iteration

    def act(self, observations: npt.NDArray[np.float32]) -> Array:
        """Actions of observations, (n, OBSERVED) to (n, 4)."""
        # A sum in a fixed order, not BLAS's: one file flies one flight on every processor.
        acted = np.repeat(self.offset[None], len(observations), axis=0)
        for j in range(OBSERVED):
            acted += observations[:, j, None].astype(float) * self.weights[:, j]
        return np.clip(acted, -1.0, 1.0)

    @property
    def options(self) -> BatchOptions:
        """Of the environments that it flies in."""
        return BatchOptions(observe=self.observe, actions=self.actions)


def fly_episodes(batch: FlightBatch, seeds: Iterable[int], act: Act) -> Returns:
    """Fly one episode in every flight of a batch, each seeded as its environment would be.

    Args:
        batch: The flights.
        seeds: One for each.
        act: Gives actions, (n, 4), of observations, (n, OBSERVED).
    """
    n = batch.count
    batch.begin(range(n), [seeding.np_random(seed)[0] for seed in seeds])
    seen, flies = batch.look(), np.ones(n, bool)
    returns, steps = np.zeros(n), np.zeros(n)
    for _ in range(batch.max_steps):
        outcome = batch.step(act(seen), flies)
        returns += outcome.rewards
        steps += flies
        seen, flies = outcome.observations, flies & ~outcome.lost
        if not flies.any():
            break
    return Returns(returns, ~flies, steps * batch.seconds, _off(batch))


def _off(batch: FlightBatch) -> Array:
    """Distance of each flight from its place or line [m]."""
    body, goal = batch.fleet.flights["plant"]["body"]["position"], batch.task.goal
    off = np.stack([body[axis] - at for axis, at in zip("xyz", goal.place, strict=True)], axis=1)
    return np.linalg.norm(off[:, 1:] if goal.kind == CRUISE_NORTH else off, axis=1)  # type: ignore[no-any-return]


def nothing(observations: npt.NDArray[np.float32]) -> Array:
    """The zero policy."""
    return np.zeros((len(observations), ACTED))


def compared(task: str, seeds: range, policies: Mapping[str, LinearPolicy]) -> dict[str, Returns]:
    """Returns of the product's controllers, of the zero policy and of trained ones, from the same beginnings.

    Args:
        task: Its name.
        seeds: Of the episodes.
        policies: By name; those of other tasks are left out.
    """
    found = {}
    for controller in CONTROLLER_NAMES:
        batch = FlightBatch(task, len(seeds), BatchOptions(actions="reference", controller=controller))
        found[controller] = fly_episodes(batch, seeds, nothing)
    found["zero"] = fly_episodes(FlightBatch(task, len(seeds), BatchOptions()), seeds, nothing)
    for name, policy in policies.items():
        if policy.task == task:
            found[name] = fly_episodes(FlightBatch(task, len(seeds), policy.options), seeds, policy.act)
    return found


def score_lines(task: str, found: Mapping[str, Returns]) -> list[str]:
    """Rows of the table of scores."""
    return [
        f"{task:<12}{name:<14}{r.mean:8.3f} +- {r.half_width:6.3f}{int(r.lost.sum()):6d}"
        f"{float(np.median(r.off)):10.2f}{float(r.off.max()):9.2f}"
        for name, r in found.items()
    ]


SCORE_HEAD = f"{'task':<12}{'policy':<14}{'return':>8}    {'95 %':>6}{'lost':>6}{'off [m]':>10}{'worst':>9}"


def load_policy(path: Path) -> LinearPolicy:
    """A policy from a file.

    Raises:
        SitlError: Names the file, and what is wrong with it.
    """
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        weights, offset = np.array(kept["weights"], float), np.array(kept["offset"], float)
        policy = LinearPolicy(
            str(kept["task"]),
            str(kept["actions"]),
            str(kept["observe"]),
            weights,
            offset,
            int(kept["seed"]),
            tuple(float(mean) for mean in kept["curve"]),
        )
    except OSError as error:
        raise SitlError(f"{path}: {error.strerror}") from error
    except (ValueError, TypeError, KeyError) as error:
        raise SitlError(f"{path}: no policy: {error!r}") from error
    if (
        weights.shape != (ACTED, OBSERVED)
        or offset.shape != (ACTED,)
        or not np.isfinite((weights.sum(), *offset)).all()
    ):
        raise SitlError(f"{path}: weights must be {ACTED} x {OBSERVED} finite numbers, the offset {ACTED}")
    return policy


def policy_text(policy: LinearPolicy) -> str:
    """The text of a policy's file."""
    kept: dict[str, Any] = policy._asdict()
    kept |= {name: np.round(kept[name], 6).tolist() for name in ("weights", "offset")}
    return json.dumps(kept | {"curve": [round(mean, 4) for mean in policy.curve]}, indent=1) + "\n"


def shipped_policies() -> dict[str, LinearPolicy]:
    """The policies that come with the product, by name."""
    return {path.stem: load_policy(path) for path in sorted(TRAINED.glob("*.json"))}
