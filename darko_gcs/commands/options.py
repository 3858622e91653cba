"""Options that several commands share."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["add_link_options", "add_listen_options", "sitl_arguments"]


def add_link_options(made: argparse.ArgumentParser) -> None:
    """Where to listen, where to record, and the vehicle process."""
    link = made.add_argument_group("link")
    add_listen_options(link)
    link.add_argument("--record", type=Path, metavar="DIR", help="where flights are recorded [the user's data folder]")
    link.add_argument(
        "--give-key", action="store_true", help="give the key to a vehicle that has none; over loopback only"
    )
    sitl = made.add_argument_group("vehicle process")
    sitl.add_argument("--sitl", action="store_true", help="start darko-sitl and stop it in the end")
    sitl.add_argument("--speed", metavar="X", help="its speed, times real time [1]")
    sitl.add_argument("--seed", metavar="N", help="its seed [1]")
    sitl.add_argument("--wind", metavar="M/S@DEG", help="its steady wind [0]")
    sitl.add_argument("--gusts", metavar="RMS", help="its gusts [0]")
    sitl.add_argument("--start", metavar="N,E,UP,YAW", help="where it begins; UP > 0 begins hovering [0,0,0,0]")
    sitl.add_argument("--airframe", metavar="SET", help="its parameter set [nominal]")
    sitl.add_argument("--state-dir", metavar="DIR", help="where it keeps parameters and mission")


def add_listen_options(link: argparse._ArgumentGroup) -> None:
    """Where to listen, and what to believe."""
    link.add_argument("--host", default="127.0.0.1", help="local address to listen on [127.0.0.1]")
    link.add_argument("--port", type=_port, default=14550, metavar="P", help="local UDP port; 0: any [14550]")
    link.add_argument(
        "--vehicle", type=_system, metavar="ID", help="system id of the vehicle, 1 to 255 [of the first that is heard]"
    )
    link.add_argument(
        "--signing-key",
        metavar="KEY",
        help="sign, and believe only what is signed: 64 hexadecimal digits or a file with them (--sitl gets it too)",
    )


def sitl_arguments(args: argparse.Namespace) -> list[str]:
    """The options that go on to darko-sitl."""
    names = ("signing_key", "speed", "seed", "wind", "gusts", "start", "airframe", "state_dir")
    given = [(name, getattr(args, name)) for name in names if getattr(args, name) is not None]
    return [part for name, value in given for part in (f"--{name.replace('_', '-')}", str(value))]


def _system(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 255:
        raise argparse.ArgumentTypeError(f"{text} is not a system id")
    return value


def _port(text: str) -> int:
    value = int(text)
    if not 0 <= value <= 65535:
        raise argparse.ArgumentTypeError(f"{text} is not a UDP port")
    return value
