"""Hover or fly: the break-even distance, and the errors of the prediction."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Mapping, Sequence

from protocol.dialect.vocabulary import DecisionReason, Way
from sitl.lab.studies.break_even.break_even import LEG_TURNS, BreakEven, flown, table
from sitl.lab.studies.break_even.break_even_flights import (
    ErrorSizes,
    PredictionError,
    abilities,
    draw,
    fly_all,
    prediction_error,
)
from sitl.lab.studies.break_even.break_even_plot import save_plot
from sitl.tools.plotting import check_plot_path

CHECKED_LEGS = {"forward": 150, "hover": 75}  # legs flown to check the prediction of each way
WIND_CLASSES = (("calm", 0.0, 1e-9), ("wind below 3 m/s", 1e-9, 3.0), ("wind of 3 to 5.7 m/s", 3.0, math.inf))


def run(args: argparse.Namespace) -> int:
    """Predict, fly if asked, print the tables and draw the plot."""
    if args.plot is not None:
        check_plot_path(args.plot)

    able = abilities(args.airframe, args.airspeed)
    cells = table(able)
    found, errors = _fly(args) if args.fly else ([], {})
    if args.json:
        print(json.dumps(_data(cells, found, errors), indent=1))
    else:
        print("\n".join(_lines(cells, found, errors)))
    if args.plot is not None:
        save_plot(able, cells, found, args.plot)
        if not args.json:
            print(f"plot: {args.plot}")
    return 0


def _fly(args: argparse.Namespace) -> tuple[list[BreakEven], dict[str, PredictionError]]:
    able = abilities(args.airframe, args.airspeed)
    found = [flown(able, args.airframe, climb, turn=turn) for turn in LEG_TURNS for climb in (0.0, 10.0, -10.0)]
    errors = {}
    for name, way in (("hover", Way.HOVER), ("forward", Way.FORWARD)):
        flights = fly_all(draw(CHECKED_LEGS[name], able, forward=way is Way.FORWARD), way, args.airframe)
        for wind, low, high in WIND_CLASSES:
            kind = [one for one in flights if low <= math.hypot(one.leg.tail_wind, one.leg.cross_wind) < high]
            errors[f"{name}, {wind}"] = prediction_error(kind)
    return found, errors


def _lines(
    cells: Sequence[BreakEven], found: Sequence[BreakEven], errors: Mapping[str, PredictionError]
) -> Iterator[str]:
    yield "Distance from which forward flight costs less than the hover [m], predicted"
    yield "(t: shorter legs are too short for the supervisor, s: shorter legs are too steep; -: not within 300 m)"
    climbs = sorted({cell.climb for cell in cells})
    for turn in sorted({cell.turn for cell in cells}):
        yield f"\nturned by {math.degrees(turn):.0f} deg at the start; columns: climb, rows: wind along the leg"
        yield f"{'':>9}" + "".join(f"{climb:+8.0f} m" for climb in climbs)
        for wind in sorted({cell.tail_wind for cell in cells}):
            row = {c.climb: c for c in cells if (c.turn, c.tail_wind) == (turn, wind)}
            yield f"{wind:+5.0f} m/s" + "".join(f"{_distance(row[climb]):>10}" for climb in climbs)
    if found:
        yield "\nin calm                     predicted     flown"
    for cell in found:
        known = next(c for c in cells if c[:4] == cell[:4])
        legs = f"climb {cell.climb:+.0f} m, turned {math.degrees(cell.turn):.0f} deg"
        yield f"{legs:<26}{_distance(known):>11}{_distance(cell):>10}"
    if errors:
        yield f"\nerror of the prediction{'':10}{'legs':>5}{'lost':>5}   median / 90 % / mean"
    for name, e in errors.items():
        yield f"{name:<33}{e.legs:>5}{e.lost:>5}   time {_error(e.time)}, energy {_error(e.energy)}"


def _distance(cell: BreakEven) -> str:
    mark = {DecisionReason.TOO_SHORT: " t", DecisionReason.TOO_STEEP: " s"}.get(cell.barred, "  ")
    return f"{cell.distance:.1f}{mark}" if math.isfinite(cell.distance) else "-  "


def _error(sizes: ErrorSizes) -> str:
    return f"{sizes.median:.1%} / {sizes.p90:.1%} / {sizes.mean:+.1%}"


def _data(
    cells: Sequence[BreakEven], found: Sequence[BreakEven], errors: Mapping[str, PredictionError]
) -> dict[str, object]:
    """All results; distances that were not found are null."""
    return {
        "ok": True,
        "predicted": [_cell(cell) for cell in cells],
        "flown": [_cell(cell) for cell in found],
        "errors": {name: error._asdict() for name, error in errors.items()},
    }


def _cell(cell: BreakEven) -> dict[str, object]:
    distance = cell.distance if math.isfinite(cell.distance) else None
    return cell._asdict() | {"distance": distance, "barred": cell.barred.name}
