"""Hover or fly: the break-even distance, and what the prediction is worth."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sitl.studies.break_even import Cell
    from sitl.studies.break_even_flights import Error

SAMPLE = {"forward": 150, "hover": 75}  # legs flown to check the prediction
WINDS = (("calm", 0.0, 1e-9), ("wind below 3 m/s", 1e-9, 3.0), ("wind of 3 to 5.7 m/s", 3.0, math.inf))


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl breakeven``."""
    made = argparse.ArgumentParser(prog="darko-sitl breakeven", description=commands["breakeven"] + ".")
    made.add_argument("--airframe", default="nominal", metavar="SET", help="parameter set or TOML file [nominal]")
    made.add_argument("--airspeed", type=float, default=15.0, metavar="V", help="of the cruise [15 m/s]")
    made.add_argument("--fly", action="store_true", help="fly break-evens in calm and random legs (three minutes)")
    made.add_argument("--plot", type=Path, metavar="FILE", help="draw it as well: .png, .svg or .pdf")
    made.add_argument("--json", action="store_true", help="print JSON instead of tables")
    return made


def run(args: argparse.Namespace) -> int:
    """Predict, fly if asked, print the tables and draw the plot."""
    from sitl.studies.break_even import table  # noqa: PLC0415 - --help must not load the compiler
    from sitl.studies.break_even_flights import abilities  # noqa: PLC0415
    from sitl.studies.break_even_plot import save_plot  # noqa: PLC0415

    able = abilities(args.airframe, args.airspeed)
    cells = table(able)
    tried, errors = _flights(args) if args.fly else ([], {})
    if args.json:
        print(json.dumps(_data(cells, tried, errors), indent=1))
    else:
        print("\n".join(_lines(cells, tried, errors)))
    if args.plot is not None:
        save_plot(able, cells, tried, args.plot)
        if not args.json:
            print(f"plot: {args.plot}")
    return 0


def _flights(args: argparse.Namespace) -> tuple[list[Cell], dict[str, Error]]:
    from protocol.dialect.vocabulary import Way  # noqa: PLC0415
    from sitl.studies.break_even import TURNS, flown  # noqa: PLC0415
    from sitl.studies.break_even_flights import abilities, draw, error, fly_all  # noqa: PLC0415

    able = abilities(args.airframe, args.airspeed)
    tried = [flown(able, args.airframe, climb, turn=turn) for turn in TURNS for climb in (0.0, 10.0, -10.0)]
    errors = {}
    for name, way in (("hover", Way.HOVER), ("forward", Way.FORWARD)):
        flights = fly_all(draw(SAMPLE[name], able, forward=way is Way.FORWARD), way, args.airframe)
        for air, low, high in WINDS:
            kind = [one for one in flights if low <= math.hypot(one.leg.tail_wind, one.leg.cross_wind) < high]
            errors[f"{name}, {air}"] = error(kind)
    return tried, errors


def _lines(cells: Sequence[Cell], tried: Sequence[Cell], errors: Mapping[str, Error]) -> Iterator[str]:
    yield "Distance from which the wing costs less than the hover [m], predicted"
    yield "(t: barred below as too short for the supervisor, s: as too steep; -: not within 300 m)"
    climbs = sorted({cell.climb for cell in cells})
    for turn in sorted({cell.turn for cell in cells}):
        yield f"\nturned by {math.degrees(turn):.0f} deg at the start; columns: climb, rows: wind along the leg"
        yield f"{'':>9}" + "".join(f"{climb:+8.0f} m" for climb in climbs)
        for wind in sorted({cell.tail_wind for cell in cells}):
            row = {c.climb: c for c in cells if (c.turn, c.tail_wind) == (turn, wind)}
            yield f"{wind:+5.0f} m/s" + "".join(f"{_distance(row[climb]):>10}" for climb in climbs)
    if tried:
        yield "\nin calm                     predicted     flown"
    for cell in tried:
        known = next(c for c in cells if c[:4] == cell[:4])
        legs = f"climb {cell.climb:+.0f} m, turned {math.degrees(cell.turn):.0f} deg"
        yield f"{legs:<26}{_distance(known):>11}{_distance(cell):>10}"
    if errors:
        yield f"\nerror of the prediction{'':10}{'legs':>5}{'lost':>5}   median / 90 % / mean"
    for name, e in errors.items():
        yield f"{name:<33}{e.legs:>5}{e.lost:>5}   time {_error(e.time)}, energy {_error(e.energy)}"


def _distance(cell: Cell) -> str:
    from protocol.dialect.vocabulary import DecisionReason  # noqa: PLC0415

    mark = {DecisionReason.TOO_SHORT: " t", DecisionReason.TOO_STEEP: " s"}.get(cell.barred, "  ")
    return f"{cell.distance:.1f}{mark}" if math.isfinite(cell.distance) else "-  "


def _error(sizes: tuple[float, float, float]) -> str:
    return f"{sizes[0]:.1%} / {sizes[1]:.1%} / {sizes[2]:+.1%}"


def _data(cells: Sequence[Cell], tried: Sequence[Cell], errors: Mapping[str, Error]) -> dict[str, object]:
    """Everything, distances that are not found as null."""
    return {
        "predicted": [_cell(cell) for cell in cells],
        "flown": [_cell(cell) for cell in tried],
        "errors": {name: error._asdict() for name, error in errors.items()},
    }


def _cell(cell: Cell) -> dict[str, object]:
    distance = cell.distance if math.isfinite(cell.distance) else None
    return cell._asdict() | {"distance": distance, "barred": cell.barred.name}
