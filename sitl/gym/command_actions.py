"""Work of ``darko-sitl gym``: a table of scores, and the flight of a policy as a log."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from gymnasium.utils import seeding

from sitl.errors import SitlError
from sitl.gym.episode_log import FlightFollower
from sitl.gym.flight_batch import FlightBatch
from sitl.gym.flight_tasks import TASKS, task_of
from sitl.gym.policies import (
    SCORE_HEAD,
    LinearPolicy,
    compared,
    load_policy,
    score_lines,
    shipped_policies,
)


def print_scores(args: argparse.Namespace) -> int:
    """Print the mean return of each controller and policy, with 95 % intervals.

    Raises:
        SitlError: If there is no such task, or a file is no policy.
    """
    if args.episodes < 1:
        raise SitlError(f"--episodes {args.episodes}: there must be at least 1")
    for task in args.tasks:
        task_of(task)
    policies = shipped_policies() | {path.stem: load_policy(path) for path in args.policy}
    print(SCORE_HEAD)
    for task in args.tasks or TASKS:
        found = compared(task, range(args.first, args.first + args.episodes), policies)
        print("\n".join(score_lines(task, found)), flush=True)
    return 0


def fly_policy(args: argparse.Namespace) -> int:
    """Fly one episode and write its log.

    Raises:
        SitlError: If there is no such policy, or the log cannot be written.
    """
    shipped = shipped_policies()
    policy = shipped[args.policy] if args.policy in shipped else load_policy(Path(args.policy))
    total, seconds, lost = flown_episode(policy, args.seed, args.log)
    print(f"{policy.task}, seed {args.seed}: return {total:.3f}, {'lost' if lost else 'ended'} after {seconds:.1f} s")
    return int(lost)


def flown_episode(policy: LinearPolicy, seed: int, log: Path) -> tuple[float, float, bool]:
    """Fly one episode of a policy and write its log; gives its return, its length [s], and whether it was lost."""
    batch = FlightBatch(policy.task, 1, policy.options)
    batch.begin([0], [seeding.np_random(seed)[0]])
    seen, total, steps, lost = batch.look(), 0.0, 0, False
    follower = FlightFollower(batch)
    while steps < batch.max_steps and not lost:
        outcome = batch.step(policy.act(seen), np.ones(1, bool))
        seen, lost, steps = outcome.observations, bool(outcome.lost[0]), steps + 1
        total += float(outcome.rewards[0])
        follower.follow()
    follower.finish(log)
    return total, steps * batch.seconds, lost
