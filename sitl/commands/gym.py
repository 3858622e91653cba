"""Scores of policies in the environments for agents, and their flights as logs."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import whole_number


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl gym``."""
    options = CommandParser(prog="darko-sitl gym", description=commands["gym"] + ".")
    actions = options.add_subparsers(dest="action", required=True, metavar="ACTION", title="actions")
    score = actions.add_parser("score", help="mean return of our controllers and of trained policies", description="")
    score.add_argument("tasks", nargs="*", metavar="TASK", help="Hover, Transition, Leg, Fall, Gust [all]")
    score.add_argument("--episodes", type=whole_number, default=100, metavar="N", help="of each [100]")
    score.add_argument("--first", type=whole_number, default=1, metavar="SEED", help="seed of the first [1]")
    score.add_argument("--policy", type=Path, action="append", default=[], metavar="FILE", help="a policy besides ours")
    fly = actions.add_parser("fly", help="fly a trained policy and write the log of the flight", description="")
    fly.add_argument("policy", metavar="POLICY", help="a file, or the name of one that is shipped (hover)")
    fly.add_argument("--log", type=Path, required=True, metavar="FILE", help="the log to write (.tlog)")
    fly.add_argument("--seed", type=whole_number, default=1, metavar="N", help="of the episode [1]")
    return options


def run(args: argparse.Namespace) -> int:
    """Print scores, or fly."""
    from sitl.gym import command_actions  # noqa: PLC0415 - --help must not load the compiler

    return command_actions.print_scores(args) if args.action == "score" else command_actions.fly_policy(args)
