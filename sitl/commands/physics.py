"""``darko-sitl physics``: the plant, its sensors and its world, flown by somebody else's autopilot."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import ipv4_address, natural_number, nonnegative_number, port_number, whole_number
from sitl.commands.airframe import tell_warnings
from sitl.commands.run import home_option, start_option, wind_option
from sitl.defaults import AIRFRAME

_EXAMPLES = """\
examples:
  darko-sitl physics ardupilot                          sim_vehicle.py -v ArduPlane --model JSON:127.0.0.1
  darko-sitl physics px4 --arena voliere                PX4 by motion capture under the net
  darko-sitl physics betaflight                         betaflight_SITL
  darko-sitl physics px4 --wind 5@270 --fail left-elevon:stuck@30
  darko-sitl physics ardupilot --instances 3            three, on UDP 9002, 9012 and 9022

It goes as fast as the autopilot answers. While it runs, type pause, go, reset, counts, wind 5@270,
fail UNIT:WAY, with @START or +SECONDS or without.
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl physics``."""
    options = CommandParser(
        prog="darko-sitl physics",
        description=commands["physics"] + " (docs/physics.md).",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    options.add_argument("autopilot", choices=("ardupilot", "px4", "betaflight"), help="who flies")
    _add_link_options(options.add_argument_group("link"))
    _add_world_options(options.add_argument_group("vehicle and world"))
    options.add_argument("--quiet", action="store_true", help="print errors only")
    return options


def _add_link_options(link: argparse._ArgumentGroup) -> None:
    link.add_argument(
        "--port", type=port_number, metavar="P", help="of instance 0; 0: any [9002, 4560 or 9001, by autopilot]"
    )
    link.add_argument("--bind", type=ipv4_address, default="127.0.0.1", metavar="ADDRESS", help="[127.0.0.1]")
    link.add_argument(
        "--autopilot-address",
        type=ipv4_address,
        default="127.0.0.1",
        metavar="ADDRESS",
        help="Betaflight's [127.0.0.1]",
    )
    link.add_argument("--instance", type=natural_number, default=0, metavar="N", help="the first one's number [0]")
    link.add_argument("--instances", type=_count, default=1, metavar="N", help="how many, each on its port [1]")
    link.add_argument(
        "--outputs",
        metavar="FILE",
        help="what moves motors and elevons: ardupilot, px4, betaflight, betaflight-tailsitter, or a TOML file "
        "[by autopilot]",
    )
    link.add_argument(
        "--speed",
        type=nonnegative_number,
        default=0.0,
        metavar="X",
        help="most multiple of real time; 0: as fast as the autopilot answers [0]",
    )
    link.add_argument(
        "--on-restart",
        choices=("reset", "keep"),
        default="reset",
        help="when the autopilot begins anew: the vehicle goes back to its start, or stays [reset]",
    )
    link.add_argument(
        "--nav",
        choices=("satellites", "mocap", "both"),
        help="what PX4 is given to find its place by [satellites; mocap under a net]",
    )


def _add_world_options(world: argparse._ArgumentGroup) -> None:
    world.add_argument("--airframe", metavar="SET", help=f"a shipped set or a TOML file [{AIRFRAME}]")
    world.add_argument("--sensors", metavar="FILE", help="TOML file that overrides values of the sensors, or truthful")
    world.add_argument("--seed", type=natural_number, default=1, metavar="N", help="of gusts and sensors [1]")
    world.add_argument("--home", type=home_option, metavar="LAT,LON,ALT", help="origin of the local frame")
    world.add_argument(
        "--start", type=start_option, metavar="N,E,UP,YAW", help="metres and degrees; UP > 0: in the air [0,0,0,0]"
    )
    world.add_argument("--arena", default="open", metavar="FILE", help="open, voliere, or a TOML file [open]")
    world.add_argument("--wind", type=wind_option, default=(0.0, 0.0), metavar="M/S@DEG", help="from there [0]")
    world.add_argument("--gusts", type=nonnegative_number, default=0.0, metavar="RMS", help="m/s rms per axis [0]")
    world.add_argument(
        "--fail",
        action="append",
        default=[],
        metavar="UNIT:WAY@START[+SECONDS]",
        help="have an instrument or actuator fail, such as gnss:off@30+10; may be repeated",
    )


def run(args: argparse.Namespace) -> int:
    """Serve until it is interrupted."""
    tell_warnings(args.airframe)
    from sitl.physics.journal import print_line  # noqa: PLC0415 - --help must not load the compiler
    from sitl.physics.serving import serve_physics  # noqa: PLC0415

    serve_physics(args, (lambda _text: None) if args.quiet else print_line)
    return 0


def _count(text: str) -> int:
    value = whole_number(text)
    if not 1 <= value <= 100:
        raise argparse.ArgumentTypeError(f"{text} is not a number of instances, 1 to 100")
    return value
