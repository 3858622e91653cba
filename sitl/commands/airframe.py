"""Parameter sets."""

from __future__ import annotations

import argparse
from collections.abc import Mapping


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl airframe``."""
    made = argparse.ArgumentParser(prog="darko-sitl airframe", description=commands["airframe"] + ".")
    made.add_argument("name", nargs="?", help="a shipped set or a TOML file; without one the sets are listed")
    return made


def run(args: argparse.Namespace) -> int:
    """List the shipped sets, or check and show one."""
    from sitl.airframe import available, load  # noqa: PLC0415 - --help must not load the compiler

    if args.name is None:
        for name in available():
            print(f"{name:<22}{load(name).description}")
        return 0
    airframe = load(args.name)
    print(f"{airframe.name}: {airframe.description}\n{airframe.path} sha256 {airframe.sha256}")
    for key, entry in airframe.values.items():
        print(f"  {key:<16}{entry.value!s:>14} {entry.unit:<10} {entry.source}")
    return 0
