"""Train the reference policy: augmented random search (Mania, Guy and Recht, 2018) of a linear policy.

``python scripts/train_reference.py [--task Hover] [--actions rates] [--iterations 150] [--seed 1] [--out FILE]`` prints
the mean return by iteration and writes the policy with seed and curve. All candidates of an iteration fly at once as
one batch, a pair of opposite ones from the same beginnings. One seed gives one policy.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from sitl.errors import SitlError
from sitl.gym.action_kinds import ACTED
from sitl.gym.flight_batch import BatchOptions, FlightBatch
from sitl.gym.policies import LinearPolicy, compared, fly_episodes, policy_text, score_lines
from sitl.gym.rewards import OBSERVED
from sitl.model.airframe import Array

DIRECTIONS = 24  # of a random search, each tried both ways
BEST = 12  # of them that are followed
EPISODES = 2  # of each candidate
REACH, STEP_SIZE = 0.15, 0.15  # of the search, and of its steps
FIRST_TEST_SEED = 10**6


def candidates(weights: Array, deltas: Array) -> Array:
    """Weights of all candidates, one for each flight, (n, 4, OBSERVED + 1)."""
    both = np.concatenate([weights + REACH * deltas, weights - REACH * deltas])
    return np.repeat(both, EPISODES, axis=0)


def tried(batch: FlightBatch, weights: Array, seeds: list[int]) -> Array:
    """Mean return of each candidate."""

    def act(seen: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> Array:
        known = np.concatenate([seen, np.ones((len(seen), 1))], axis=1)
        acted: Array = np.clip((weights * known[:, None, :]).sum(axis=2), -1.0, 1.0)
        return acted

    means: Array = fly_episodes(batch, seeds, act).returns.reshape(-1, EPISODES).mean(axis=1)
    return means


def stepped(weights: Array, deltas: Array, returns: Array) -> Array:
    """The weights after one iteration: along the best directions, by the difference that each made."""
    ahead, back = returns[: len(deltas)], returns[len(deltas) :]
    best = np.argsort(-np.maximum(ahead, back), kind="stable")[:BEST]
    spread = float(np.concatenate([ahead[best], back[best]]).std()) + 1e-6
    slope = ((ahead - back)[best, None, None] * deltas[best]).mean(axis=0)
    moved: Array = weights + STEP_SIZE / spread * slope
    return moved


def trained(task: str, actions: str, seed: int, iterations: int) -> LinearPolicy:
    """The policy after some iterations."""
    random = np.random.default_rng(seed)
    count = 2 * DIRECTIONS * EPISODES
    batch = FlightBatch(task, count, BatchOptions(actions=actions))
    weights, curve = np.zeros((ACTED, OBSERVED + 1)), []
    for iteration in range(iterations):
        deltas = random.standard_normal((DIRECTIONS, ACTED, OBSERVED + 1))
        seeds = np.tile(random.integers(FIRST_TEST_SEED, size=EPISODES), 2 * DIRECTIONS).tolist()
        returns = tried(batch, candidates(weights, deltas), seeds)
        weights = stepped(weights, deltas, returns)
        curve.append(float(returns.mean()))
        if iteration % 10 == 0:
            print(f"{iteration:5d}  mean return {curve[-1]:7.3f}  {time.process_time():6.0f} s", flush=True)
    return LinearPolicy(task, actions, "truth", weights[:, :-1], weights[:, -1], seed, tuple(curve))


def main() -> None:
    """Train, compare with the product's controllers, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="Hover")
    parser.add_argument("--actions", default="rates")
    parser.add_argument("--iterations", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--test-episodes", type=int, default=100, help="of the comparison in the end")
    parser.add_argument("--out", type=Path, help="JSON file of the policy")
    args = parser.parse_args()
    try:
        policy = trained(args.task, args.actions, args.seed, args.iterations)
        if args.out is not None:
            args.out.write_text(policy_text(policy), encoding="utf-8")
        seeds = range(FIRST_TEST_SEED, FIRST_TEST_SEED + args.test_episodes)
        print("\n".join(score_lines(args.task, compared(args.task, seeds, {"trained": policy}))))
    except (SitlError, OSError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
