"""Falls from any attitude: height lost by the supervisor and by the whole vehicle."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import (
    Airframe,
    Array,
    Body,
    Law,
    Quaternion,
    Simulation,
    Start,
    Tuning,
    Vector,
    fly_batch,
    hover_at,
)
from sitl.lab.campaigns.campaign_summary import passed, summary_lines
from sitl.lab.studies.seeded_flights import (
    check_seeded,
    craft_of,
    seeds,
    write_json,
)
from sitl.lab.studies.spec_studies import case_rows, craft_changes, flown_study
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Falls from any attitude: how much height the supervisor needs, beside the zero-moment law alone from the same draws.
#
# A draw is an attitude, uniform over all of them, and a tumble about a random axis; the velocity is that of its kind of
# fall. Flights begin so high that none meets the ground, and fly side by side in batches.

FALL_HEIGHT = 600.0  # where the falls begin whose height is measured [m]
MAX_TUMBLE = 8.0  # [rad/s]
RETURN_SECONDS = 75.0  # after which everything is home
FALL_SECONDS = 30.0  # after which nothing falls any more
SAMPLE_RATE = 25.0  # a second
HOME_RADIUS = 1.0  # [m]
SAME_HEIGHT = 1.0  # heights that differ by less are the same [m]
ALONE = Tuning(v_enter=0.0, v_leave=math.inf)  # nothing ends the law that begins

FALL_KINDS = {
    "5 m/s down": (0.0, 0.0, -5.0),
    "8 m/s down": (0.0, 0.0, -8.0),
    "10 m/s down": (0.0, 0.0, -10.0),
    "13 m/s down": (0.0, 0.0, -13.0),
    "15 m/s down": (0.0, 0.0, -15.0),
    "20 m/s down": (0.0, 0.0, -20.0),
    "12 m/s level, 8 down": (12.0, 0.0, -8.0),
    "18 m/s level": (18.0, 0.0, 0.0),
}
MAP_SINKS = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0)  # [m/s]
MAP_TUMBLES = (0.0, 2.0, 4.0, 6.0, 8.0)  # [rad/s]


class Throw(NamedTuple):
    """Attitude and rates at the beginning of a fall."""

    attitude: Quaternion
    rates: Vector  # [rad/s]


class HeightLost(NamedTuple):
    """Height lost in one kind of fall, one entry per draw."""

    kind: str
    supervisor: Array  # (n,) [m]
    alone: Array  # (n,) by the zero-moment law alone [m]
    away: Array  # (n,) from where it began, in the end [m]

    @property
    def not_home(self) -> int:
        """Flights that are elsewhere in the end."""
        return int(np.count_nonzero(~(self.away <= HOME_RADIUS)))

    @property
    def worse(self) -> int:
        """Draws from which the supervisor loses more than the law alone."""
        return int(np.count_nonzero(~(self.supervisor <= self.alone + SAME_HEIGHT)))


class MapCell(NamedTuple):
    """Height lost from one sink rate and one tumble, upright or not."""

    sink: float  # [m/s]
    tumble: float  # [rad/s]
    lost: Array  # (n,) [m]


def thrown(random: np.random.Generator, tumble: float | None = None) -> Throw:
    """A random attitude, and a tumble about a random axis; its rate is drawn too unless it is given [rad/s]."""
    attitude = random.normal(size=4)
    axis = random.normal(size=3)
    rate = random.uniform(0.0, MAX_TUMBLE) if tumble is None else tumble
    q, w = attitude / np.linalg.norm(attitude), rate * axis / np.linalg.norm(axis)
    return Throw(Quaternion(*(float(x) for x in q)), Vector(*(float(x) for x in w)))


def falling(
    airframe: Airframe,
    seed: int,
    velocity: Iterable[float],
    *,
    tumble: float | None = None,
    law: Law = Law.HOVER_ZERO_MOMENT,
    tuning: Tuning | None = None,
) -> Simulation:
    """A simulation at the beginning of a fall in still air, wanted where it is.

    Args:
        airframe: What falls.
        seed: Of the draw.
        velocity: World NWU [m/s].
        tumble: Its rate [rad/s]; drawn by default.
        law: In force in the beginning.
        tuning: Of the controller.
    """
    throw = thrown(np.random.default_rng(seed), tumble)
    made = Simulation(airframe, seed=seed, start=Start(up=FALL_HEIGHT, airborne=True), tuning=tuning)
    north, west, up = (float(x) for x in velocity)
    made.place(Body(Vector(0.0, 0.0, FALL_HEIGHT), Vector(north, west, up), throw.attitude, throw.rates))
    made.begin_flight(law)
    made.reference = hover_at((0.0, 0.0, FALL_HEIGHT), 0.0)
    return made


def fall(flights: Sequence[Simulation], seconds: float = RETURN_SECONDS) -> tuple[Array, Array]:
    """Fly falls for a time; gives height lost and distance from where they began, (n,) each [m]."""
    recordings = fly_batch(flights, seconds, rate=SAMPLE_RATE)
    lost = [FALL_HEIGHT - float(recording.position[:, 2].min()) for recording in recordings]
    away = [math.dist(flight.truth.body.position, (0.0, 0.0, FALL_HEIGHT)) for flight in flights]
    return np.array(lost), np.array(away)


def heights(airframe: Airframe, flights: int, first: int = 1, tuning: Tuning | None = None) -> list[HeightLost]:
    """Every kind of fall from the same draws, seeds ``first`` on: under the supervisor, and under the law alone.

    Args:
        airframe: What falls.
        flights: Draws of each kind.
        first: Seed of the first.
        tuning: Of the controller under the supervisor.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    drawn = seeds(flights, first)
    results = []
    for kind, velocity in FALL_KINDS.items():
        supervisor, away = fall([falling(airframe, seed, velocity, tuning=tuning) for seed in drawn])
        alone, _ = fall([falling(airframe, seed, velocity, tuning=ALONE) for seed in drawn], FALL_SECONDS)
        results.append(HeightLost(kind, supervisor, alone, away))
    return results


def height_map(airframe: Airframe, flights: int, first: int = 1, tuning: Tuning | None = None) -> list[MapCell]:
    """Height lost over sink rate and tumble; arguments as for :func:`heights`."""
    drawn, cells = seeds(flights, first), []
    for sink in MAP_SINKS:
        for tumble in MAP_TUMBLES:
            flown = [falling(airframe, seed, (0.0, 0.0, -sink), tumble=tumble, tuning=tuning) for seed in drawn]
            lost, _ = fall(flown, FALL_SECONDS)
            cells.append(MapCell(sink, tumble, lost))
    return cells


def summary(results: Sequence[HeightLost]) -> list[str]:
    """Height lost by kind of fall, as lines of text: median, nineteen in twenty, the worst."""
    lines = [f"{'height lost [m]':<24}{'supervisor':^24}{'zero-moment law alone':^24}   worse  not home"]
    for r in results:
        figures = "".join(f"{_quantile(lost, share):8.1f}" for lost in (r.supervisor, r.alone) for share in _SHARES)
        lines.append(f"{r.kind:<24}{figures}{r.worse:8d}{r.not_home:10d}")
    return lines


def map_lines(cells: Sequence[MapCell]) -> list[str]:
    """The map as lines of text: median / nineteen in twenty / worst."""
    lines = [f"{'height needed [m]':<18}" + "".join(f"{tumble:>12g} rad/s" for tumble in MAP_TUMBLES)]
    for sink in MAP_SINKS:
        row = [cell for cell in cells if cell.sink == sink]
        figures = [" / ".join(f"{_quantile(cell.lost, share):.0f}" for share in _SHARES) for cell in row]
        lines.append(f"{sink:>4g} m/s down     " + "".join(f"{text:>18}" for text in figures))
    return lines


_SHARES = (0.5, 0.95, 1.0)


def _quantile(values: Array, share: float) -> float:
    return float(np.quantile(values, share))


# A page of falls: the height they need over sink rate and tumble, and the supervisor beside the law alone.


DARK = 60.0  # cells beyond this are dark [m]
PANELS = ((0.5, "median"), (0.95, "nineteen in twenty"), (1.0, "worst"))


def save_plot(results: Sequence[HeightLost], cells: Sequence[MapCell], path: Path) -> None:
    """Draw the map, and the distribution of the height lost by kind of fall.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(11.0, 7.0)
    grid = page.add_gridspec(2, len(PANELS))
    for column, (share, title) in enumerate(PANELS):
        _map(page.add_subplot(grid[0, column]), cells, share, title)
    _distributions(page.add_subplot(grid[1, :]), results)
    save_page(page, path, dpi=90)


def _map(axis: Axes, cells: Sequence[MapCell], share: float, title: str) -> None:
    needed = np.array([np.quantile(cell.lost, share) for cell in cells]).reshape(len(MAP_SINKS), len(MAP_TUMBLES))
    axis.imshow(needed, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=100.0, aspect="auto")
    for row, column in np.ndindex(*needed.shape):
        axis.text(
            column,
            row,
            f"{needed[row, column]:.0f}",
            ha="center",
            va="center",
            color="white" if needed[row, column] > DARK else "black",
        )
    axis.set_xticks(range(len(MAP_TUMBLES)), [f"{tumble:g}" for tumble in MAP_TUMBLES])
    axis.set_yticks(range(len(MAP_SINKS)), [f"{sink:g}" for sink in MAP_SINKS])
    axis.set_xlabel("tumble [rad/s]")
    axis.set_ylabel("sink rate [m/s]")
    axis.set_title(f"height needed [m], {title}")


def _distributions(axis: Axes, results: Sequence[HeightLost]) -> None:
    for r in results:
        share = np.arange(1, len(r.supervisor) + 1) / len(r.supervisor)
        (line,) = axis.plot(np.sort(r.supervisor), share, label=r.kind)
        axis.plot(np.sort(r.alone), share, linestyle=":", color=line.get_color())
    axis.set_xlabel("height lost [m]; dotted: the zero-moment law alone from the same draws")
    axis.set_ylabel("share of the falls")
    axis.legend(loc="lower right", fontsize=8)
    axis.grid(alpha=0.3)


def study_falls(args: argparse.Namespace) -> int:
    """Fly the falls and print their figures; exit code 1 if one needs more height than it should or too many crash."""
    check_seeded(args, {}, ["draws"])
    if args.plot is not None:
        check_plot_path(args.plot)

    craft = craft_of(args)
    model = craft.model
    lost = heights(model, args.draws, args.first, craft.tuning)
    print(f"{args.draws} draws, seeds {args.first} to {args.first + args.draws - 1}; median, 95 %, worst")
    print("\n".join(summary(lost)), flush=True)
    cells = height_map(model, args.draws, args.first, craft.tuning)
    print("\nmedian / 95 % / worst")
    print("\n".join(map_lines(cells)), flush=True)
    whole = []
    for campaign in ("falls-calm", "falls"):
        whole.append(flown_study(args, campaign, craft_changes(craft)))
        print("", *summary_lines(*whole[-1]), sep="\n", flush=True)
    if args.json is not None:
        write_json(args.json, _rows(lost, cells) | {f.result.specification.name: case_rows(*f[:2]) for f in whole})
    if args.plot is not None:
        save_plot(lost, cells, args.plot)
    return 0 if is_caught(lost) and all(passed(*flown[:2]) for flown in whole) else 1


def is_caught(heights: Sequence[HeightLost]) -> bool:
    """Whether no fall needs more height than under the law alone, and all end at home."""
    return not any(result.worse or result.not_home for result in heights)


def _rows(heights: Sequence[HeightLost], cells: Sequence[MapCell]) -> dict[str, object]:
    return {
        "heights": [{"kind": r.kind, "supervisor": r.supervisor.tolist(), "alone": r.alone.tolist()} for r in heights],
        "map": [{"sink": c.sink, "tumble": c.tumble, "lost": c.lost.tolist()} for c in cells],
    }
