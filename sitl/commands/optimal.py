"""``darko-sitl optimal``: the bound that no flight of a leg beats, and flights beside it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import finite_number, nonnegative_number
from sitl.commands.airframe import tell_warnings
from sitl.defaults import AIRFRAME, CONTROLLER_NAMES, HOVERING_CONTROLLER
from sitl.errors import SitlError
from sitl.lab import study_options


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl optimal``."""
    options = CommandParser(prog="darko-sitl optimal", description=commands["optimal"] + ".")
    subcommands = options.add_subparsers(dest="subcommand", required=True, metavar="WHAT", title="what is done")
    about = "find the least time or energy of a leg to the north, and check the answer"
    _add_leg(subcommands.add_parser("leg", help=about, description=about + "."))
    about = "print bounds of many legs, and what each controller flies beside them"
    table = subcommands.add_parser("table", help=about, description=about + ".")
    table.add_argument("rows", nargs="*", metavar="ROW", help="such as level-100, up-30, ahead-100, turn180-30 [all]")
    table.add_argument("--bounds-only", action="store_true", help="fly nothing")
    table.add_argument("--results", type=Path, metavar="FILE", help="also write the results there as JSON")
    _add_airframe(table)
    about = "fly legs of the table on sensors, in gusts, with a wrong model, from many seeds, beside their bounds"
    _add_flights(subcommands.add_parser("flights", help=about, description=about + "."))
    return options


def _add_flights(flights: argparse.ArgumentParser) -> None:
    flights.add_argument("rows", nargs="*", metavar="ROW", help="as for table [all but those to and from a cruise]")
    flights.add_argument("--gusts", type=finite_number, default=0.5, metavar="RMS", help="per axis, m/s rms [0.5]")
    flights.add_argument(
        "--parameters", type=finite_number, default=0.1, metavar="SHARE", help="error of the model at most [0.1]"
    )
    flights.add_argument("--airspeed", type=finite_number, default=15.0, metavar="M/S", help="in forward flight [15]")
    flights.add_argument(
        "--way", choices=("chosen", "upright", "forward"), default="chosen", help="as the vehicle chooses [chosen]"
    )
    flights.add_argument("--flights-only", action="store_true", help="find no bounds")
    study_options.add_seeded(flights, 10, "flights of each row", airframe=AIRFRAME)


def _add_airframe(options: argparse.ArgumentParser) -> None:
    options.add_argument("--airframe", default=AIRFRAME, metavar="SET", help=f"parameter set or TOML file [{AIRFRAME}]")


def _add_leg(leg: argparse.ArgumentParser) -> None:
    leg.add_argument("distance", type=nonnegative_number, metavar="M", help="length of the leg")
    leg.add_argument("--climb", type=finite_number, default=0.0, metavar="M", help="height gained [0]")
    leg.add_argument("--turn", type=finite_number, default=0.0, metavar="DEG", help="from the heading to the leg [0]")
    leg.add_argument("--tail", type=finite_number, default=0.0, metavar="M/S", help="wind along the leg [0]")
    leg.add_argument("--cross", type=finite_number, default=0.0, metavar="M/S", help="wind from its right [0]")
    leg.add_argument("--start", choices=("hover", "cruise"), default="hover", help="[hover]")
    leg.add_argument(
        "--end", choices=("hover", "cruise", "point"), default="hover", help="point: a hover of any heading [hover]"
    )
    leg.add_argument("--airspeed", type=finite_number, default=15.0, metavar="M/S", help="of a cruise [15]")
    leg.add_argument("--energy", action="store_true", help="least energy instead of least time")
    leg.add_argument("--price", type=nonnegative_number, metavar="W", help="least energy, a second counting as so much")
    leg.add_argument("--front", action="store_true", help="from least energy to least time in five steps")
    leg.add_argument(
        "--room", type=nonnegative_number, nargs=2, default=[1.0, 8.0], metavar=("BELOW", "ABOVE"), help="[1 8] m"
    )
    leg.add_argument(
        "--nose", type=finite_number, nargs=2, default=[-60.0, 150.0], metavar=("LOW", "HIGH"), help="[-60 150] deg"
    )
    leg.add_argument(
        "--sideways", type=finite_number, default=6.0, metavar="M/S", help="air along the wing at most, in space [6]"
    )
    leg.add_argument(
        "--share-left", type=finite_number, default=0.0, metavar="SHARE", help="of the actuators, for feedback [0]"
    )
    leg.add_argument("--arena", default="", metavar="FILE", help="stay in its net, off its obstacles [none]")
    leg.add_argument(
        "--place",
        type=finite_number,
        nargs=3,
        default=[0.0, 0.0, 50.0],
        metavar=("NORTH", "WEST", "UP"),
        help="of the start [0 0 50] m",
    )
    leg.add_argument("--space", action="store_true", help="three dimensions also where the leg lies in a plane")
    leg.add_argument("--plot", type=Path, metavar="FILE", help="also write a page (.html) or plots (.png, .svg, .pdf)")
    leg.add_argument(
        "--controller",
        choices=(*CONTROLLER_NAMES, HOVERING_CONTROLLER),
        metavar="NAME",
        help="with --plot: fly the leg beside the bound",
    )
    _add_airframe(leg)


def run(args: argparse.Namespace) -> int:
    """Find a leg's bound, print the table, or fly its legs."""
    if find_spec("casadi") is None:
        raise SitlError("darko-sitl optimal needs CasADi: pip install 'darko[optimal]'")
    tell_warnings(args.airframe)
    from sitl.lab.optimal import seeded_legs, yardstick  # noqa: PLC0415 - --help must not load the compiler

    actions = {"leg": yardstick.find_leg, "table": yardstick.show_table, "flights": seeded_legs.fly_rows}
    return actions[args.subcommand](args)
