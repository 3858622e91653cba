"""``darko-sitl optimal``: a bound, a front of time against energy, and the table of legs flown beside bounds."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sitl import SitlError
from sitl.defaults import CONTROLLER_NAMES
from sitl.lab.optimal.bound import Bound, as_lines, find_bound
from sitl.lab.optimal.flown_leg import LegFlight, fly_ways, stretches
from sitl.lab.optimal.leg_page import check_page, write_page
from sitl.lab.optimal.question import CRUISE_END, POINT_END, Question
from sitl.lab.studies.seeded_flights import write_json

LEFT = 0.3  # share of the actuators that the table's second bound leaves
FRONT_PRICES = (0.0, 30.0, 100.0, 300.0, math.inf)  # of time, along a front [W]
HALF_TURN, QUARTER_TURN = math.pi, 0.5 * math.pi
ROW_KINDS: Mapping[str, Mapping[str, float | str]] = {
    "level": {},
    "up": {"climb": 20.0},
    "down": {"climb": -20.0},
    "turn90": {"turn": QUARTER_TURN, "end": POINT_END},
    "turn180": {"turn": HALF_TURN, "end": POINT_END},
    "ahead": {"tail_wind": -5.0},
    "behind": {"tail_wind": 5.0},
    "aside": {"cross_wind": 5.0, "end": POINT_END},
    "to-cruise": {"end": CRUISE_END},
    "to-hover": {"start": CRUISE_END},
}
DISTANCES = (10.0, 30.0, 100.0, 300.0)  # [m]
ROW_NAMES = tuple(f"{kind}-{distance:g}" for kind in ROW_KINDS for distance in DISTANCES)


class TableRow(NamedTuple):
    """A leg of the table; a bound that was not found is None, with the reason among ``faults``."""

    name: str
    bounds: dict[tuple[float, float], Bound | None]  # by the price of time and the share left
    flights: list[LegFlight]
    faults: list[str]

    def best(self, controller: str, *, in_time: bool) -> LegFlight | None:
        """The controller's quickest or cheapest flight; None if none arrives."""
        own = [one for one in self.flights if one.controller == controller and math.isfinite(one.time)]
        return min(own, key=lambda one: one.time if in_time else one.energy, default=None)


def row_question(name: str, airframe: str) -> Question:
    """The leg of a row of the table.

    Raises:
        SitlError: There is no such row.
    """
    if name not in ROW_NAMES:
        raise SitlError(
            f"the table has no row {name!r}; it has {', '.join(ROW_KINDS)}, each with -10, -30, -100 or -300"
        )
    kind, _, distance = name.rpartition("-")
    return Question(airframe=airframe, distance=float(distance))._replace(**ROW_KINDS[kind])  # type: ignore[arg-type]


def shown_bound(question: Question) -> Bound:
    """A bound, its iterations shown on a terminal, and in no file.

    Raises:
        SitlError: It has none.
    """
    return find_bound(question, quiet=not sys.stderr.isatty())


def measured(name: str, airframe: str, controllers: Sequence[str], *, bounds_only: bool) -> TableRow:
    """A row: four bounds, and the leg by each controller.

    Raises:
        SitlError: There is no such row or airframe.
    """
    leg = row_question(name, airframe)
    bounds: dict[tuple[float, float], Bound | None] = {}
    faults = []
    for price in (math.inf, 0.0):
        for left in (0.0, LEFT):
            try:
                bounds[price, left] = shown_bound(leg._replace(time_price=price, share_left=left))
            except SitlError as error:
                bounds[price, left] = None
                faults.append(str(error))
    flights = [] if bounds_only else fly_ways(leg, controllers)
    return TableRow(name, bounds, flights, faults)


def table_lines(rows: Sequence[TableRow], controllers: Sequence[str]) -> list[str]:
    """The table, as GitHub's Markdown reads it, and where each leg's energy goes."""
    head = ["leg", f"least time ({LEFT:.0%} left) [s]", *(f"{name} [s]" for name in controllers)]
    head += [f"least energy ({LEFT:.0%} left) [J]", *(f"{name} [J]" for name in controllers)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(_cells(row, controllers)) + " |" for row in rows]
    for row in rows:
        lines += ["", *_stretch_lines(row, controllers)] if row.flights else []
        lines += [f"{row.name}: {fault}" for fault in row.faults]
    return lines


def _cells(row: TableRow, controllers: Sequence[str]) -> list[str]:
    cells = [row.name]
    for price, in_time in ((math.inf, True), (0.0, False)):
        free, left = (_value(row.bounds[price, share], in_time=in_time) for share in (0.0, LEFT))
        places = 2 if in_time else 0
        marks = ["" if bound is None or bound.agrees else "*" for bound in (row.bounds[price, s] for s in (0.0, LEFT))]
        cells.append(f"{_number(free, places)}{marks[0]} ({_number(left, places)}{marks[1]})")
        for controller in controllers:
            flown = row.best(controller, in_time=in_time)
            if flown is None:
                cells.append("-")
                continue
            value = flown.time if in_time else flown.energy
            ratios = f"**{value / free:.2f}** ({value / left:.2f})".replace("nan", "-")
            cells.append(f"{value:.{places or 0}f} {flown.way.words}: {ratios}")
    return cells


def _value(bound: Bound | None, *, in_time: bool) -> float:
    if bound is None:
        return math.nan
    return bound.time if in_time else bound.energy


def _number(value: float, places: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{places}f}"


def _stretch_lines(row: TableRow, controllers: Sequence[str]) -> list[str]:
    """Time and energy by stretch: of the cheapest flights and of least energy."""
    bound = row.bounds[0.0, 0.0]
    if bound is None:
        return []
    length = float(bound.plant[-1, 0] - bound.plant[0, 0])
    drawn = np.concatenate([[0.0], np.cumsum(0.5 * (bound.power[1:] + bound.power[:-1]) * np.diff(bound.times))])
    lines = [f"{row.name}, cheapest by stretch: the first metres, between, the last metres"]
    of = {"least energy": stretches(bound.times, bound.plant[:, 0] - bound.plant[0, 0], drawn, length)}
    for controller in controllers:
        flown = row.best(controller, in_time=False)
        if flown is not None:
            of[controller] = stretches(flown.times, flown.plant[:, 0] - bound.plant[0, 0], flown.drawn, length)
    return lines + [
        f"  {name:<14}" + ",  ".join(f"{part.time:5.2f} s {part.energy:6.0f} J" for part in parts)
        for name, parts in of.items()
    ]


def front(question: Question) -> list[Bound]:
    """Bounds from least energy to least time.

    Raises:
        SitlError: One of them has no solution.
    """
    return [shown_bound(question._replace(time_price=price)) for price in FRONT_PRICES]


def front_lines(bounds: Sequence[Bound]) -> list[str]:
    """The front as a table; what a second costs is the slope between two of its points."""
    lines = [f"{'time price [W]':>15}{'time [s]':>10}{'energy [J]':>12}{'a second less costs [J]':>25}"]
    slopes = [math.nan]
    slopes += [
        (after.energy - before.energy) / max(before.time - after.time, 1e-9) for before, after in pairwise(bounds)
    ]
    for bound, slope in zip(bounds, slopes, strict=True):
        price = bound.question.time_price
        told = "least time" if math.isinf(price) else f"{price:g}"
        lines.append(f"{told:>15}{bound.time:>10.2f}{bound.energy:>12.0f}{_number(slope, 0):>25}")
    return lines


def question_of(args: argparse.Namespace) -> Question:
    """The question that a command line asks."""
    if args.energy and args.price is not None:
        raise SitlError("--energy and --price: give one of them")
    price = 0.0 if args.energy else math.inf if args.price is None else args.price
    return Question(
        airframe=args.airframe,
        distance=args.distance,
        climb=args.climb,
        turn=math.radians(args.turn),
        tail_wind=args.tail,
        cross_wind=args.cross,
        start=args.start,
        end=args.end,
        airspeed=args.airspeed,
        time_price=price,
        room=(args.room[0], args.room[1]),
        nose=(args.nose[0], args.nose[1]),
        sideways=args.sideways,
        share_left=args.share_left,
        arena=args.arena,
        place=(args.place[0], args.place[1], args.place[2]),
        in_space=args.space,
    )


def find_leg(args: argparse.Namespace) -> int:
    """Print a leg's bound with its checks, or a front, and draw it beside flights; exit code 1: the checks fail."""
    question = question_of(args)
    question.check()
    if args.plot is not None:
        check_page(args.plot)
    bounds = front(question) if args.front else [shown_bound(question)]
    for bound in bounds:
        print("\n".join(as_lines(bound)))
    if args.front:
        print("\n".join(front_lines(bounds)))
    if args.plot is not None:
        flights = fly_ways(question, [args.controller]) if args.controller else []
        write_page(bounds, [one for one in flights if math.isfinite(one.time)], args.plot)
        print(f"wrote {args.plot}")
    return 0 if all(bound.agrees for bound in bounds) else 1


def show_table(args: argparse.Namespace) -> int:
    """Print rows of the table; exit code 1: a bound is missing or does not agree with itself."""
    names = args.rows or ROW_NAMES
    for name in names:
        row_question(name, args.airframe).check()
    if args.results is not None and not args.results.parent.is_dir():
        raise SitlError(f"{args.results}: there is no folder {args.results.parent}")
    rows = []
    for number, name in enumerate(names, 1):
        rows.append(measured(name, args.airframe, CONTROLLER_NAMES, bounds_only=args.bounds_only))
        print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
    print("\n".join(table_lines(rows, [] if args.bounds_only else CONTROLLER_NAMES)))
    if any(b is not None and not b.agrees for row in rows for b in row.bounds.values()):
        print("* guesses and meshes do not agree within 1 %")
    if args.results is not None:
        write_json(args.results, [_plain(row) for row in rows])
    return 0 if all(b is not None and b.agrees for row in rows for b in row.bounds.values()) else 1


def _plain(row: TableRow) -> dict[str, object]:
    """A row as JSON holds it."""
    bounds = [
        {"time_price": price if math.isfinite(price) else None, "share_left": left, "time": b.time, "energy": b.energy}
        | {"agrees": b.agrees}
        for (price, left), b in row.bounds.items()
        if b is not None
    ]
    flown = [
        {"controller": f.controller, "way": f.way.words, "time": f.time, "energy": f.energy}
        for f in row.flights
        if math.isfinite(f.time)
    ]
    return {"row": row.name, "bounds": bounds, "flown": flown, "faults": row.faults}
