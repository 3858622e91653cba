"""What is in a recorded flight."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from darko_gcs.commands import log_info


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs log``."""
    made = argparse.ArgumentParser(prog="darko-gcs log", description=commands["log"] + ".")
    kinds = made.add_subparsers(required=True, metavar="info")
    log_info.configure(kinds.add_parser("info", help="vehicles, messages, damage and the flight of one log"))
    return made


def run(args: argparse.Namespace) -> int:
    """Print it."""
    from darko_gcs.errors import GroundError  # noqa: PLC0415
    from protocol.errors import FileError  # noqa: PLC0415 - --help must not load the wire

    try:
        return log_info.run(args)
    except FileError as error:
        raise GroundError(str(error)) from error
