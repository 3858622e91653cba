"""Identification: an airframe's parameters from a recorded flight, and a flight that tells them."""

from __future__ import annotations

import argparse
import json
import math
import sys

from sitl.errors import SitlError
from sitl.lab.identification import flown_log
from sitl.lab.identification.airframe_writer import write_airframe
from sitl.lab.identification.excitation import Excitation
from sitl.lab.identification.identify_flight import identify
from sitl.lab.identification.residual_plot import save_residual_plot
from sitl.lab.identification.result_text import as_data, as_text
from sitl.model.airframe_files import load
from sitl.tools.plotting import check_plot_path

MAX_PARAMETER_ERROR, MAX_FLOWN_WIND, MAX_FLOWN_GUSTS = 0.3, 8.0, 3.0
MAX_CHANNEL = 16


def run(args: argparse.Namespace) -> int:
    """Identify from a log, or fly and write one."""
    _check(args)
    if args.fly is not None:
        return _fly(args)
    known, channels = _known(args), _channels(args.channels)

    base = load(args.airframe)
    in_hover = args.frame == "hover"
    found = identify(args.flight, base.parameters, known=known, channels=channels, hover_frame=in_hover)
    as_json = json.dumps({"ok": True, **as_data(found)}, indent=1) if args.json else ""
    print(as_json or as_text(found, base.name, "m" in known), flush=True)
    if args.plot is not None:
        save_residual_plot(found, base.name, args.plot)
    if args.write is not None:
        write_airframe(found, base, known, args.flight.name, args.write)
        print(f"written: fly it with --airframe {args.write}", file=sys.stderr)
    return 0


def _fly(args: argparse.Namespace) -> int:
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
