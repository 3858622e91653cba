"""Identification: an airframe's parameters from a recorded flight, and a flight that tells them."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.command_line import CommandParser
from protocol.tools.option_values import finite_number, whole_number
from sitl.defaults import AIRFRAME
from sitl.errors import SitlError
from sitl.tools.plotting import check_plot_path

MAX_PARAMETER_ERROR, MAX_FLOWN_WIND, MAX_FLOWN_GUSTS = 0.3, 8.0, 3.0
MAX_CHANNEL = 16


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study identify``."""
    options = CommandParser(
        prog="darko-sitl study identify",
        description=commands["identify"] + ".",
        epilog="docs/identification.md says what a log must hold and how sure the answer is.",
    )
    options.add_argument("flight", nargs="?", type=Path, help="telemetry log (.tlog) of the flight")
    options.add_argument(
        "--airframe", default=AIRFRAME, metavar="SET", help=f"set or TOML file to begin from [{AIRFRAME}]"
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
    return options


def run(args: argparse.Namespace) -> int:
    """Identify from a log, or fly and write one."""
    _check(args)
    if args.fly is not None:
        return _fly(args)
    known, channels = _known(args), _channels(args.channels)
    from sitl.lab.identification.identify_flight import identify  # noqa: PLC0415
    from sitl.lab.identification.result_text import as_data, as_text  # noqa: PLC0415
    from sitl.model.airframe_files import load  # noqa: PLC0415 - --help must not load the compiler

    base = load(args.airframe)
    in_hover = args.frame == "hover"
    found = identify(args.flight, base.parameters, known=known, channels=channels, hover_frame=in_hover)
    as_json = json.dumps({"ok": True, **as_data(found)}, indent=1) if args.json else ""
    print(as_json or as_text(found, base.name, "m" in known), flush=True)
    if args.plot is not None:
        from sitl.lab.identification.residual_plot import save_residual_plot  # noqa: PLC0415 - matplotlib is slow

        save_residual_plot(found, base.name, args.plot)
    if args.write is not None:
        from sitl.lab.identification.airframe_writer import write_airframe  # noqa: PLC0415

        write_airframe(found, base, known, args.flight.name, args.write)
        print(f"written: fly it with --airframe {args.write}", file=sys.stderr)
    return 0


def _fly(args: argparse.Namespace) -> int:
    from sitl.lab.identification import flown_log  # noqa: PLC0415
    from sitl.lab.identification.excitation import Excitation  # noqa: PLC0415
    from sitl.model.airframe_files import load  # noqa: PLC0415 - --help must not load the compiler

    base = load(args.airframe)
    true = flown_log.off_airframe(base.parameters, args.off, args.seed)
    wind = (args.wind * math.cos(args.seed), args.wind * math.sin(args.seed))
    excitation = Excitation(legs=()) if args.hover else Excitation()
    flown = flown_log.fly_excitation(
        true, base.parameters, seed=args.seed, wind=wind, gusts=args.gusts, excitation=excitation
    )
    flown_log.write_log(flown, args.fly, base.parameters, seed=args.seed)
    how = "it crashed" if flown.crashed else "it flew on"
    if args.json:
        told = {"file": str(args.fly), "airframe": base.name, "off": args.off, "seed": args.seed}
        print(
            json.dumps({"ok": not flown.crashed, **told, "duration": float(flown.time[-1]), "crashed": flown.crashed})
        )
    else:
        print(f"{args.fly}: {flown.time[-1]:.0f} s of {base.name}, {100 * args.off:g} % off by seed {args.seed}; {how}")
    return 1 if flown.crashed else 0


def _check(args: argparse.Namespace) -> None:
    """Refuse bad arguments before any work."""
    if (args.flight is None) == (args.fly is None):
        raise SitlError("identify takes a flight's log, or --fly and the log to write")
    if args.seed < 0:
        raise SitlError(f"--seed {args.seed}: seeds are not negative")
    for name, most in (("off", MAX_PARAMETER_ERROR), ("wind", MAX_FLOWN_WIND), ("gusts", MAX_FLOWN_GUSTS)):
        value = getattr(args, name)
        if not 0.0 <= value <= most:
            raise SitlError(f"--{name} {value:g} is not within 0 and {most:g}")
    if args.write is not None and args.write.suffix != ".toml":
        raise SitlError(f"--write {args.write}: the name must end in .toml")
    for path in (args.write, args.fly):
        if path is not None and not path.parent.is_dir():
            raise SitlError(f"{path}: there is no folder {path.parent}")
    if args.plot is not None:
        check_plot_path(args.plot)


def _known(args: argparse.Namespace) -> dict[str, float]:
    known: dict[str, float] = {}
    for text in args.known:
        key, _, value = text.partition("=")
        try:
            known[key] = float(value)
        except ValueError:
            raise SitlError(f"--known {text}: must be KEY=VALUE") from None
    if args.mass is not None:
        known["m"] = args.mass
    for key, number in known.items():
        if not (math.isfinite(number) and (number > 0.0 or key.startswith("C_"))):
            raise SitlError(f"{key} = {number:g} must be positive")
    return known


def _channels(text: str | None) -> tuple[int, ...] | None:
    if text is None:
        return None
    try:
        numbers = tuple(int(one) for one in text.split(","))
    except ValueError:
        numbers = ()
    if (
        len({abs(number) for number in numbers}) != 4
        or len(numbers) != 4
        or not all(1 <= abs(number) <= MAX_CHANNEL for number in numbers)
    ):
        raise SitlError(f"--channels {text}: must be four different outputs from 1 to {MAX_CHANNEL}, as in 1,2,3,-4")
    return numbers
