"""``darko-sitl run``: the command line of the vehicle process."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.frames import Geodetic
from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import (
    PROGRAM_PORT,
    STATION_PORT,
    VEHICLE_PORT,
    finite_number,
    ipv4_address,
    natural_number,
    nonnegative_number,
    port_number,
    positive_number,
    whole_number,
)
from sitl.defaults import (
    AIRFRAME,
    CONTROLLER_NAMES,
    EXPORTED,
    HOVERING_CONTROLLER,
    MAX_ORIGIN_ALTITUDE,
    MAX_ORIGIN_LATITUDE,
)
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.autopilot.world import World
    from sitl.process.vehicle_process import LiveExperiment
    from sitl.vehicle.aircraft import Aircraft

EXAMPLES = """\
examples:
  darko-sitl                          real time, telemetry to 127.0.0.1:14550 and :14540
  darko-sitl --speed 10 --seed 7      ten times real time, another seed
  darko-sitl --speed 0                as fast as possible
  darko-sitl --wind 5@270 --gusts 1   5 m/s from the west, gusts of 1 m/s rms
  darko-sitl --arena voliere          indoors, by motion capture
  darko-sitl --controller report      the report's switched laws instead of the hybrid controller
  darko-sitl --airframe published     the constants that ENAC published (see: darko-sitl airframe)
  darko-sitl --arena voliere --flight-plan voliere    fly the blocks of a plan
  darko-sitl --vehicles 5             five of them, system ids 1 to 5, on the same port
  darko-sitl --scenario far-target    an experiment of the report, for a ground station to watch

Of several vehicles none sees another: collisions between them are not simulated.

The vehicle is system 1, component 1. It answers everyone who speaks to it. QGroundControl finds it on port 14550,
MAVSDK on udpin://127.0.0.1:14540. Stop it with Ctrl-C.

other commands (darko-sitl COMMAND --help):
"""


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl [run]``."""
    width = max(map(len, commands), default=0) + 2
    listing = "".join(f"  {name:<{width}}{text}\n" for name, text in commands.items() if name != "run")
    parser = CommandParser(
        prog="darko-sitl",
        description="DarkO as a software-in-the-loop vehicle: full model, hybrid controller, MAVLink 2 over UDP.",
        epilog=EXAMPLES + listing,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit (without other options)")
    simulation = parser.add_argument_group("simulation")
    _add_simulation_options(simulation)
    _add_navigation_options(simulation)
    _add_fleet_options(parser.add_argument_group("several vehicles"))
    _add_flight_plan_options(parser.add_argument_group("flight plan (see: darko-sitl plan)"))
    _add_scenario_options(parser.add_argument_group("scenario or day (see: darko-sitl study scenario, darko-sitl day)"))
    _add_link_options(parser.add_argument_group("link"))
    parser.add_argument(
        "--state-dir",
        type=Path,
        default=None,
        metavar="DIR",
        help="stores parameters, plans, home and logs between runs, of one process at a time [the user's data folder, "
        "of other system ids than 1 its vehicle-ID]",
    )
    parser.add_argument("--quiet", action="store_true", help="print errors and warnings only")
    return parser


def _add_simulation_options(simulation: argparse._ArgumentGroup) -> None:
    simulation.add_argument(
        "--speed",
        type=nonnegative_number,
        default=1.0,
        metavar="X",
        help="multiple of real time; 0: as fast as possible [1]",
    )
    simulation.add_argument(
        "--seed",
        type=natural_number,
        default=1,
        metavar="N",
        help="equal seeds give equal flights, bit for bit [1]",
    )
    simulation.add_argument(
        "--airframe", metavar="SET", help=f"parameter set or TOML file [{AIRFRAME}, or the scenario's own]"
    )
    simulation.add_argument(
        "--controller",
        type=_controller,
        default=None,
        metavar="{hybrid,report,indi,robust-pi,c:DIR}",
        help="the hybrid controller, the report's switched laws, INDI alone, the robust PI law, which hovers only, or "
        "the C that darko-sitl export wrote to DIR [as DRK_CONTROLLER is set: hybrid]",
    )
    simulation.add_argument(
        "--wind",
        type=wind_option,
        default=None,
        metavar="M/S@DEG",
        help="steady wind and the direction it comes from [0]",
    )
    simulation.add_argument(
        "--gusts", type=nonnegative_number, default=None, metavar="RMS", help="gusts per axis, m/s rms [0]"
    )
    simulation.add_argument(
        "--home",
        type=home_option,
        default=None,
        metavar="LAT,LON,ALT",
        help="origin of the local frame, and home until it is moved; degrees and metres [the flight plan's, else the "
        "arena's own, else ENAC's, Toulouse]",
    )
    simulation.add_argument(
        "--start",
        type=start_option,
        default=None,
        metavar="N,E,UP,YAW",
        help="where the flight begins, in metres and degrees; UP > 0: hovering [0,0,0,0]",
    )
    simulation.add_argument(
        "--arena",
        default="open",
        metavar="FILE",
        help="where it flies: open, voliere (net and wind wall), obstacle-course, or a TOML file [open]",
    )
    simulation.add_argument(
        "--param",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="set a parameter for this run; may be repeated",
    )


def _add_navigation_options(simulation: argparse._ArgumentGroup) -> None:
    simulation.add_argument(
        "--nav",
        choices=("sensors", "mocap", "truth"),
        default=None,
        help="what the vehicle navigates by: satellites, compass, barometer and inertial sensors; motion capture and "
        "inertial sensors; or the exact state [sensors; mocap under a net; truth in scenarios]",
    )
    simulation.add_argument(
        "--mocap",
        choices=("internal", "external"),
        default=None,
        help="with --nav mocap: poses of the simulated cameras, or only those that peers send, as "
        "'darko-gcs bridge' does [as SIM_MOCAP says: internal]",
    )
    simulation.add_argument(
        "--sensors",
        metavar="FILE",
        default=None,
        help="TOML file that overrides values of the sensors, or 'truthful': less kind ones",
    )


def _add_fleet_options(fleet: argparse._ArgumentGroup) -> None:
    fleet.add_argument(
        "--vehicles",
        type=_count,
        default=1,
        metavar="N",
        help="fly N vehicles on one port; each has its own seed (--seed and up), home, and state folder (vehicle-ID in "
        "the folder of --state-dir). They do not see one another and cannot collide [1]",
    )
    fleet.add_argument("--sysid", type=_system, default=1, metavar="FIRST", help="system id, or the first of them [1]")
    fleet.add_argument(
        "--spacing",
        type=positive_number,
        default=5.0,
        metavar="M",
        help="they start on a square grid, east and north of --start, so far apart [5]",
    )


def _add_flight_plan_options(plan: argparse._ArgumentGroup) -> None:
    plan.add_argument(
        "--flight-plan",
        type=Path,
        default=None,
        metavar="FILE",
        help="fly this Paparazzi flight plan, or a shipped one: voliere, wind-wall; mode FLIGHT_PLAN from the start, "
        "at the plan's origin",
    )
    plan.add_argument(
        "--flight-plan-names",
        type=Path,
        default=None,
        metavar="FILE",
        help="TOML file: what functions and variables of the plan's build mean",
    )
    plan.add_argument(
        "--flight-plan-procedures",
        type=Path,
        default=None,
        metavar="DIR",
        help="another folder than the plan's that the procedures it includes may lie in",
    )


def _add_scenario_options(scenario: argparse._ArgumentGroup) -> None:
    scenario.add_argument(
        "--scenario",
        metavar="NAME",
        help="fly this experiment, print its figures and exit; exit code 1 if a figure is not as expected. "
        "A command that moves the vehicle ends the experiment, and the vehicle goes on flying",
    )
    scenario.add_argument(
        "--day",
        type=Path,
        metavar="FILE",
        help="fly a day live, as 'darko-sitl day' flies it headless (docs/day.md)",
    )
    scenario.add_argument("--stay", action="store_true", help="hold after the experiment instead of exiting")


def _add_link_options(link: argparse._ArgumentGroup) -> None:
    link.add_argument(
        "--port", type=port_number, default=VEHICLE_PORT, metavar="P", help=f"local port; 0: any [{VEHICLE_PORT}]"
    )
    link.add_argument(
        "--bind",
        type=ipv4_address,
        default="127.0.0.1",
        metavar="ADDRESS",
        help="local IPv4 address to listen on; 0.0.0.0: all networks, so set a signing key too [127.0.0.1]",
    )
    link.add_argument(
        "--gcs-port",
        type=port_number,
        default=STATION_PORT,
        metavar="P",
        help=f"port of ground stations here; 0: none [{STATION_PORT}]",
    )
    link.add_argument(
        "--api-port",
        type=port_number,
        default=PROGRAM_PORT,
        metavar="P",
        help=f"port of programs here; 0: none [{PROGRAM_PORT}]",
    )
    link.add_argument(
        "--signing-key",
        action="append",
        default=[],
        metavar="[PORT=]KEY",
        help="sign, and obey only signed messages: 64 hexadecimal digits or a file with them; with PORT= only for the "
        "peer on that local port; may be repeated [the key that a ground station has set, or none]",
    )
    link.add_argument(
        "--autopilot",
        choices=("px4", "generic"),
        default="px4",
        help="autopilot type to report; with 'generic' most ground stations hide their flight buttons [px4]",
    )


def run(args: argparse.Namespace) -> int:
    """Fly until interrupted, or until the scenario has ended."""
    if args.stay and args.scenario is None:
        raise SitlError("--stay needs --scenario: without one the vehicle stays anyway")
    for option in ("names", "procedures"):
        if getattr(args, f"flight_plan_{option}") is not None and args.flight_plan is None:
            raise SitlError(f"--flight-plan-{option} needs --flight-plan")
    if args.vehicles > 1:
        from sitl.process.fleet_process import fly_fleet  # noqa: PLC0415 - --help must not load the compiler

        return fly_fleet(args)
    from sitl.process.vehicle_process import fly  # noqa: PLC0415

    return fly(args, experiment(args))


def experiment(args: argparse.Namespace) -> LiveExperiment | None:
    """The scenario that the arguments name, with a print of its figures at its end."""
    if args.scenario is None:
        return None
    from sitl.lab.live_scenario import LiveScenario, scenario_aircraft  # noqa: PLC0415
    from sitl.lab.scenarios import as_text  # noqa: PLC0415
    from sitl.process.vehicle_process import LiveExperiment  # noqa: PLC0415

    live: LiveScenario

    def build(world: World, parameters: Mapping[str, float]) -> Aircraft:
        nonlocal live
        aircraft = scenario_aircraft(args, world, parameters)
        live = aircraft.live
        return aircraft

    def finish() -> int:
        if not args.quiet:
            print(as_text(live.scenario, live.flown, live.findings), flush=True)
        return 0 if all(finding.holds for finding in live.findings) else 1

    return LiveExperiment(build, lambda: live.complete, finish)


def _count(text: str) -> int:
    value = whole_number(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of vehicles")
    return value


def _system(text: str) -> int:
    value = whole_number(text)
    if not 1 <= value <= 254:  # 255 is the ground station's usual id
        raise argparse.ArgumentTypeError(f"{text} is not a vehicle's system id, 1 to 254")
    return value


def _controller(text: str) -> str:
    """The name of a controller, or ``c:`` and a folder."""
    names = (*CONTROLLER_NAMES, HOVERING_CONTROLLER)
    if text in names or text.removeprefix(EXPORTED) not in {text, ""}:
        return text
    raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(names)} and {EXPORTED}DIR")


def wind_option(text: str) -> tuple[float, float]:
    """A wind, ``M/S@DEG``: its speed [m/s] and the direction it comes from [deg]."""
    speed, at, direction = text.partition("@")
    if at and not direction:
        raise argparse.ArgumentTypeError(f"{text!r} has no direction after the @; 5@270 is 5 m/s from the west")
    return nonnegative_number(speed), finite_number(direction) if at else 0.0


def _numbers(text: str, names: tuple[str, ...]) -> tuple[float, ...]:
    parts = text.split(",")
    if len(parts) != len(names):
        raise argparse.ArgumentTypeError(f"{text!r} is not {','.join(names)}")
    return tuple(finite_number(part) for part in parts)


def home_option(text: str) -> Geodetic:
    """An origin, ``LAT,LON,ALT`` [deg], [deg], [m]."""
    home = Geodetic(*_numbers(text, ("LAT", "LON", "ALT")))
    if abs(home.lat_deg) > MAX_ORIGIN_LATITUDE or abs(home.lon_deg) > 180.0:
        raise argparse.ArgumentTypeError(f"{text!r}: LAT must be within ±{MAX_ORIGIN_LATITUDE:g}, LON within ±180")
    if abs(home.alt) > MAX_ORIGIN_ALTITUDE:
        raise argparse.ArgumentTypeError(f"{text!r}: ALT must be within ±{MAX_ORIGIN_ALTITUDE:g} m")
    return home


def start_option(text: str) -> tuple[float, ...]:
    """A start, ``N,E,UP,YAW`` [m], [m], [m], [deg]."""
    start = _numbers(text, ("N", "E", "UP", "YAW"))
    if start[2] < 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is below the ground")
    if abs(start[3]) > 360.0:
        raise argparse.ArgumentTypeError(f"{text!r}: YAW must be within ±360")
    return start


def _assignment(text: str) -> tuple[str, float]:
    name, separator, value = text.partition("=")
    if not separator:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, finite_number(value)
