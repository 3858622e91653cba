"""Arguments of each study, by its name; they load nothing of the vehicle."""

from __future__ import annotations

import argparse
from pathlib import Path

from protocol.tools.option_values import finite_number, whole_number
from sitl.defaults import BRISK, CONTROLLER_NAMES, GENTLE, HOVERING_CONTROLLER, STUDY_AIRFRAME

PAPARAZZI = "paparazzi-indi"  # INDI with the constants of :mod:`sitl.design.paparazzi_indi`
HOVER, ASKED, AIR = "hover", "asked", "air"
DEFAULT_FLIGHTS = {HOVER: 100, ASKED: 500, AIR: 300}
DEFAULT_WINDS = {HOVER: 5.0, ASKED: 5.0, AIR: 12.0}  # [m/s]
DEFAULT_GUSTS = {HOVER: 0.5, ASKED: 1.0, AIR: 2.0}  # [m/s]
LANDING_HEIGHT = 8.0  # where a landing from a hover begins [m]
KINDS = (
    f"{HOVER}: landings from a hover; {ASKED}: RTL and LAND asked for anywhere on the way past home; "
    f"{AIR}: ten minutes of holds, legs and broken-off descents each, with no touch-down"
)


def campaign(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study campaign``."""
    add_seeded(options, 200, "how many flights")
    options.add_argument("--wind", type=finite_number, default=5.0, metavar="M/S", help="maximum steady wind [5]")
    options.add_argument(
        "--gusts", type=finite_number, default=1.0, metavar="RMS", help="maximum gusts per axis, m/s rms [1]"
    )
    options.add_argument(
        "--parameters",
        type=finite_number,
        default=0.1,
        metavar="SHARE",
        help="maximum relative error of the design model [0.1]",
    )
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the results: .png, .svg or .pdf")


def falls(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study falls``."""
    add_seeded(options, 500, "falls of the whole vehicle, calm and windy")
    options.add_argument(
        "--draws", type=whole_number, default=200, metavar="N", help="falls of each kind, for the heights [200]"
    )
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the map: .png, .svg or .pdf")


def landings(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study landings``."""
    flights, winds, gusts = (
        "/".join(f"{value:g}" for value in by.values()) for by in (DEFAULT_FLIGHTS, DEFAULT_WINDS, DEFAULT_GUSTS)
    )
    add_seeded(options, None, f"how many flights [{flights}]")
    options.add_argument("--kind", choices=(HOVER, ASKED, AIR), default=HOVER, help=f"{KINDS} [{HOVER}]")
    options.add_argument("--wind", type=finite_number, metavar="M/S", help=f"maximum steady wind [{winds}]")
    options.add_argument("--gusts", type=finite_number, metavar="RMS", help=f"gusts per axis, m/s rms [{gusts}]")
    options.add_argument(
        "--height",
        type=finite_number,
        default=LANDING_HEIGHT,
        metavar="M",
        help=f"of the hover above the ground [{LANDING_HEIGHT:g}]",
    )
    options.add_argument("--slope", type=finite_number, default=0.0, metavar="DEG", help="slope of the ground [0]")
    options.add_argument("--ground", type=finite_number, default=0.0, metavar="M", help="its height above home [0]")


def holds(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study holds``."""
    add_seeded(options, 20, "holds in each wind")
    options.add_argument(
        "--wind", type=finite_number, nargs="+", default=[3.0, 5.0, 8.0], metavar="M/S", help="winds [3 5 8]"
    )
    options.add_argument("--gusts", type=finite_number, default=1.0, metavar="RMS", help="gusts per axis, m/s rms [1]")
    options.add_argument(
        "--parameters", type=finite_number, default=0.0, metavar="SHARE", help="error of the design model [0]"
    )


def liveness(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study liveness``."""
    add_seeded(options, 1, "flights from each law to each goal in each wind")
    options.add_argument(
        "--wind", type=finite_number, nargs="+", default=[0.0, 2.0, 4.0, 6.0, 8.0], metavar="M/S", help="[0 2 4 6 8]"
    )
    options.add_argument(
        "--parameters", type=finite_number, default=0.1, metavar="SHARE", help="error of the design model [0.1]"
    )


def legs(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study legs``."""
    add_seeded(options, 8, "legs in each wind from each side")
    options.add_argument(
        "--wind", type=finite_number, nargs="+", default=[8.0, 10.0, 12.0], metavar="M/S", help="winds [8 10 12]"
    )
    options.add_argument(
        "--gusts", type=finite_number, default=1.5, metavar="RMS", help="gusts per axis, m/s rms [1.5]"
    )
    options.add_argument(
        "--parameters", type=finite_number, default=0.15, metavar="SHARE", help="error of the design model [0.15]"
    )


def containment(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study containment``."""
    add_seeded(options, 20, "flights in each wind")
    options.set_defaults(nav="mocap")
    options.add_argument("--arena", default="voliere", metavar="FILE", help="shipped arena or TOML file [voliere]")
    options.add_argument(
        "--wall", type=finite_number, nargs="+", default=[0.0, 2.0, 4.0], metavar="M/S", help="winds [0 2 4]"
    )
    options.add_argument(
        "--bursts", type=finite_number, nargs="+", default=[0.0, 2.0], metavar="M/S", help="1-cos gusts [0 2]"
    )
    options.add_argument("--turbulence", type=finite_number, default=0.05, metavar="SHARE", help="intensity [0.05]")


def jet(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study jet``."""
    add_seeded(options, 5, "holds in each wind with each gust")
    options.set_defaults(nav="mocap")
    options.add_argument("--arena", default="voliere", metavar="FILE", help="shipped arena or TOML file [voliere]")
    options.add_argument(
        "--wall", type=finite_number, nargs="+", default=[0.0, 2.0, 4.0, 6.0], metavar="M/S", help="winds [0 2 4 6]"
    )
    options.add_argument(
        "--bursts", type=finite_number, nargs="+", default=[0.0, 1.0, 2.0, 3.0], metavar="M/S", help="gusts [0 1 2 3]"
    )
    options.add_argument("--turbulence", type=finite_number, default=0.05, metavar="SHARE", help="intensity [0.05]")
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the map")


def staircase(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study staircase``."""
    add_seeded(options, 3, "flights by each controller", also=(HOVERING_CONTROLLER, PAPARAZZI))
    options.set_defaults(nav="mocap")
    options.add_argument(
        "--wind", type=finite_number, nargs="+", metavar="M/S", help="winds, each above the one before [the flight's]"
    )
    options.add_argument("--hold", type=finite_number, default=18.0, metavar="S", help="time in each wind [18]")


def claims(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study claims``."""
    add_seeded(options, 1, "flights in each gust by each controller", also=(HOVERING_CONTROLLER,))
    options.set_defaults(nav="mocap")


def margins(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study margins``."""
    add_seeded(options, 3, "flights in each cell")
    options.add_argument(
        "--delay", type=finite_number, nargs="+", metavar="S", help="from sensor to actuator [0 to 0.08]"
    )
    options.add_argument("--noise", type=finite_number, nargs="+", metavar="X", help="factors on all noise [1 2 4 8]")
    options.add_argument("--untold", action="store_true", help="the vehicle does not know the delay")


def loops(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study loops``."""
    options.add_argument("--airframe", default=STUDY_AIRFRAME, metavar="SET", help=f"[{STUDY_AIRFRAME}]")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every loop as JSON")


def consistency(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study consistency``."""
    add_seeded(options, 100, "flights in each phase with each model")
    options.add_argument(
        "--gusts", type=finite_number, default=0.5, metavar="RMS", help="gusts per axis, m/s rms [0.5]"
    )


def failures(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study failures``."""
    add_seeded(options, 2, "flights with each failure in each phase")
    options.add_argument("--units", nargs="+", default=[], metavar="UNIT", help="such as pitot, or nothing [all]")
    options.add_argument("--failures", nargs="+", default=[], metavar="FAILURE", help="such as wrong, stuck [all]")
    options.add_argument("--phases", nargs="+", default=[], metavar="PHASE", help="such as hover, cruise [all]")
    options.add_argument("--wind", type=finite_number, default=5.0, metavar="M/S", help="greatest steady wind [5]")
    options.add_argument("--gusts", type=finite_number, default=0.5, metavar="M/S", help="rms per axis [0.5]")
    options.add_argument(
        "--parameters", type=finite_number, default=0.0, metavar="SHARE", help="greatest error of the design model [0]"
    )


def region(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study region``."""
    options.add_argument(
        "--samples", type=whole_number, default=600, metavar="N", help="flights per law and draw [600]"
    )
    options.add_argument("--seed", type=whole_number, default=1, metavar="S", help="seed of the draws [1]")
    options.add_argument("--airframe", default="nominal", metavar="SET", help="parameter set or TOML file [nominal]")
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the results: .png, .svg or .pdf")


def winds(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study winds``."""
    add_seeded(options, 20, "flights in each wind", airframe="nominal")
    options.add_argument(
        "--gusts", type=finite_number, default=0.5, metavar="RMS", help="gusts per axis, m/s rms [0.5]"
    )


def breakeven(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study breakeven``."""
    options.add_argument(
        "--airframe", default=STUDY_AIRFRAME, metavar="SET", help=f"parameter set or TOML file [{STUDY_AIRFRAME}]"
    )
    options.add_argument(
        "--airspeed", type=finite_number, default=15.0, metavar="V", help="airspeed of the cruise [15 m/s]"
    )
    options.add_argument(
        "--fly",
        action="store_true",
        help="also fly break-even distances in calm, and random legs (takes three minutes)",
    )
    add_pace(options)
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the results: .png, .svg or .pdf")
    options.add_argument("--json", action="store_true", help="print JSON instead of tables")


def regret(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study regret``."""
    add_flights(options, "legs flown both ways [1000]", 1000, STUDY_AIRFRAME)
    add_pace(options)


def add_pace(options: argparse.ArgumentParser) -> None:
    """The argument that makes INDI fly briskly."""
    options.add_argument(
        "--brisk", dest="pace", action="store_const", const=BRISK, default=GENTLE, help="INDI flies by DRK_PACE 1"
    )


def scenario(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study scenario``."""
    options.epilog = "Single flights also run live, for a ground station to watch: darko-sitl --scenario NAME."
    options.add_argument("name", nargs="?", help="which one, or 'all'; without a name they are listed")
    options.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        help="file of the plot: .png, .svg or .pdf; experiments of several runs draw .svg [NAME.png]",
    )
    options.add_argument("--no-plot", action="store_true", help="print the figures only")
    options.add_argument("--json", action="store_true", help="print JSON")
    options.add_argument(
        "--airframe", metavar="SET", help="parameter set or TOML file of a flight [the scenario's own]"
    )
    options.add_argument("--seed", type=whole_number, default=1, metavar="N", help="seed of the gusts [1]")


def report(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study report``."""
    options.add_argument(
        "-o", "--output", type=Path, default=Path("report.html"), metavar="FILE", help="where to write it [report.html]"
    )
    options.add_argument(
        "--only", nargs="+", metavar="NAME", help="run only these experiments; 'darko-sitl study scenario' lists them"
    )
    options.add_argument("--jobs", type=whole_number, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--seed", type=whole_number, default=1, metavar="N", help="seed of random draws [1]")


def validate(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study validate``."""
    options.add_argument("--airframe", default="darko", metavar="SET", help="parameter set or TOML file [darko]")
    options.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="also fly its authors' published curves: page of verdicts"
    )
    options.add_argument("--fit", action="store_true", help="also fit anew what was fitted, to the shared stretches")
    options.add_argument(
        "--spread", type=whole_number, metavar="N", help="also claims of level flight over N draws of what is assumed"
    )


def hybrid(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study hybrid``."""
    options.add_argument("name", nargs="?", help="which system; without a name they are listed")


def identify(options: argparse.ArgumentParser) -> None:
    """Arguments of ``darko-sitl study identify``."""
    options.epilog = "docs/identification.md says what a log must hold and how sure the answer is."
    options.add_argument("flight", nargs="?", type=Path, help="its log: .tlog, ULog, DataFlash .bin, Paparazzi .log")
    options.add_argument(
        "--airframe", default=STUDY_AIRFRAME, metavar="SET", help=f"set or TOML file to begin from [{STUDY_AIRFRAME}]"
    )
    options.add_argument(
        "--mass", type=finite_number, metavar="KG", help="the vehicle's mass, which no flight tells [the set's]"
    )
    options.add_argument(
        "--known", nargs="+", default=[], metavar="KEY=VALUE", help="constants of the airframe that are known, in SI"
    )
    options.add_argument(
        "--channels",
        metavar="L,R,L,R",
        help="outputs of left motor, right motor, left elevon, right elevon, from 1; negative: reversed",
    )
    options.add_argument(
        "--frame",
        choices=("hover", "forward"),
        default="hover",
        help="frame of the log's attitude and IMU; PX4's is hover [hover]",
    )
    options.add_argument("--write", type=Path, metavar="FILE", help="write the airframe as a TOML file for --airframe")
    options.add_argument("--plot", type=Path, metavar="FILE", help="draw the residuals: .png, .svg or .pdf")
    options.add_argument("--json", action="store_true", help="print JSON")
    flying = options.add_argument_group("fly instead")
    flying.add_argument("--fly", type=Path, metavar="LOG", help="simulate a flight that tells all and write its log")
    flying.add_argument(
        "--off",
        type=finite_number,
        default=0.0,
        metavar="SHARE",
        help="relative error of the flown airframe's constants [0]",
    )
    flying.add_argument("--seed", type=whole_number, default=1, metavar="N", help="seed of gusts, noise and errors [1]")
    flying.add_argument(
        "--wind", type=finite_number, default=0.0, metavar="M/S", help="wind, from an azimuth drawn by the seed [0]"
    )
    flying.add_argument("--gusts", type=finite_number, default=0.0, metavar="RMS", help="per axis, m/s rms [0]")
    flying.add_argument("--hover", action="store_true", help="stay in the hover")


def add_flights(options: argparse.ArgumentParser, text: str, flights: int | None, airframe: str) -> None:
    """Arguments of how many flights, from which seed, by how many processes, of which airframe, and a file of them."""
    options.add_argument("--flights", type=whole_number, default=flights, metavar="N", help=text)
    options.add_argument("--first", type=whole_number, default=1, metavar="SEED", help="seed of the first [1]")
    options.add_argument("--jobs", type=whole_number, default=2, metavar="N", help="processes at once [2]")
    options.add_argument("--airframe", default=airframe, metavar="SET", help=f"parameter set or TOML file [{airframe}]")
    options.add_argument("--json", type=Path, metavar="FILE", help="also write every flight as JSON")


def add_seeded(
    options: argparse.ArgumentParser,
    flights: int | None,
    flown: str,
    *,
    also: tuple[str, ...] = (),
    airframe: str = STUDY_AIRFRAME,
) -> None:
    """Arguments that all studies of many seeds have.

    Args:
        options: Of one study.
        flights: How many are flown by default; None: the study itself decides.
        flown: What ``--flights`` counts.
        also: Controllers beside the two that fly anything; with them every one flies, unless one is named.
        airframe: What flies unless told.
    """
    many = flown if flights is None else f"{flown} [{flights}]"
    add_flights(options, many, flights, airframe)
    options.add_argument(
        "--nav", default="sensors", choices=("sensors", "mocap", "truth"), help="what it navigates by [sensors]"
    )
    default, names = None if also else CONTROLLER_NAMES[0], (*CONTROLLER_NAMES, *also)
    options.add_argument("--controller", default=default, choices=names, help=f"what flies it [{default or 'each'}]")
    add_pace(options)
    options.add_argument(
        "--sensors",
        metavar="FILE",
        help="TOML file that overrides values of the sensors, or 'truthful': less kind ones",
    )
