"""Recorded flights: what is in one, and which the vehicle has."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from darko_gcs.commands import log_fetch, log_info


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-gcs log``."""
    made = argparse.ArgumentParser(prog="darko-gcs log", description=commands["log"] + ".")
    kinds = made.add_subparsers(required=True, metavar="info|fetch")
    for name, module, text in (
        ("info", log_info, "vehicles, messages, damage and the flight of one log"),
        ("fetch", log_fetch, "download the logs a vehicle has recorded itself"),
    ):
        kind = kinds.add_parser(name, help=text)
        module.configure(kind)
        kind.set_defaults(kind=module)
    return made


def run(args: argparse.Namespace) -> int:
    """Do what was asked of it."""
    from darko_gcs.errors import GroundError  # noqa: PLC0415
    from protocol.errors import FileError  # noqa: PLC0415 - --help must not load the wire

    try:
        return int(args.kind.run(args))
    except FileError as error:
        raise GroundError(str(error)) from error
