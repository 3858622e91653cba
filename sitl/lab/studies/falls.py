"""The campaigns of falls: height lost beside one law alone from the same draws, a map of it, and the whole vehicle."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl import Array
from sitl.lab.campaigns.campaign_summary import passed, summary_lines
from sitl.lab.studies.seeded_flights import check_seeded, craft_of, write_json
from sitl.lab.studies.spec_studies import FlownStudy, case_rows, craft_changes, flown_study
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SAME_HEIGHT = 1.0  # heights that differ by less are the same [m]
DARK = 60.0  # cells beyond this are dark [m]
PANELS = ((0.5, "median"), (0.95, "nineteen in twenty"), (1.0, "worst"))


def study_falls(args: argparse.Namespace) -> int:
    """Fly the falls and print their figures; exit code 1 if one needs more height than it should or too many crash."""
    check_seeded(args, {}, ["draws"])
    if args.plot is not None:
        check_plot_path(args.plot)

    craft = craft_changes(craft_of(args))
    laws_alone = {place: value for place, value in craft.items() if place != "vehicle.navigation"}  # by the truth
    many = argparse.Namespace(**vars(args) | {"flights": args.draws})
    heights, cells = (_flown(many, campaign, laws_alone) for campaign in ("fall-heights", "fall-map"))
    worse = worse_lines(heights)
    print("\n".join(worse), flush=True)
    whole = [_flown(args, campaign, craft) for campaign in ("falls-calm", "falls")]
    if args.json is not None:
        flown = (heights, cells, *whole)
        write_json(args.json, {one.result.specification.name: case_rows(*one[:2]) for one in flown})
    if args.plot is not None:
        save_plot(heights, cells, args.plot)
    return 0 if not worse and all(passed(*flown[:2]) for flown in (heights, *whole)) else 1


def _flown(args: argparse.Namespace, campaign: str, changes: dict[str, object]) -> FlownStudy:
    flown = flown_study(args, campaign, changes)
    print(*summary_lines(*flown), "", sep="\n", flush=True)
    return flown


def lost_by_kind(heights: FlownStudy) -> dict[str, Array]:
    """Heights lost from the same draws by the supervisor and by one law, of each kind of fall, (n, 2) [m]."""
    kinds, lost = np.array(heights.drawn["thrown"]), np.array(heights.result.values("lost"))
    return {kind: lost[kinds == kind].reshape(-1, 2) for kind in dict.fromkeys(heights.drawn["thrown"])}


def worse_lines(heights: FlownStudy) -> list[str]:
    """Kinds of falls in which the supervisor loses more than one law alone, with so many draws, as lines of text."""
    more = {kind: ~(lost[:, 0] <= lost[:, 1] + SAME_HEIGHT) for kind, lost in lost_by_kind(heights).items()}
    return [
        f"thrown at {kind}, {is_more.sum()} of {len(is_more)} lose over {SAME_HEIGHT:g} m more than by one law alone"
        for kind, is_more in more.items()
        if is_more.any()
    ]


# A page of falls: the height they need over sink rate and tumble, and the supervisor beside the law alone.


def save_plot(heights: FlownStudy, cells: FlownStudy, path: Path) -> None:
    """Draw the map, and the distribution of the height lost by kind of fall.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(11.0, 7.0)
    grid = page.add_gridspec(2, len(PANELS))
    for column, (share, title) in enumerate(PANELS):
        _map(page.add_subplot(grid[0, column]), cells, share, title)
    _distributions(page.add_subplot(grid[1, :]), heights)
    save_page(page, path, dpi=90)


def _map(axis: Axes, cells: FlownStudy, share: float, title: str) -> None:
    sinks, tumbles = (list(cells.result.specification.grid[name]) for name in ("sink", "tumble"))
    lost = np.array(cells.result.values("lost")).reshape(-1, len(sinks), len(tumbles))
    needed = np.quantile(lost, share, axis=0)
    axis.imshow(needed, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=100.0, aspect="auto")
    for row, column in np.ndindex(*needed.shape):
        colour = "white" if needed[row, column] > DARK else "black"
        axis.text(column, row, f"{needed[row, column]:.0f}", ha="center", va="center", color=colour)
    axis.set_xticks(range(len(tumbles)), [f"{tumble:g}" for tumble in tumbles])
    axis.set_yticks(range(len(sinks)), [f"{sink:g}" for sink in sinks])
    axis.set_xlabel("tumble [rad/s]")
    axis.set_ylabel("sink rate [m/s]")
    axis.set_title(f"height needed [m], {title}")


def _distributions(axis: Axes, heights: FlownStudy) -> None:
    for kind, lost in lost_by_kind(heights).items():
        share = np.arange(1, len(lost) + 1) / len(lost)
        (line,) = axis.plot(np.sort(lost[:, 0]), share, label=kind)
        axis.plot(np.sort(lost[:, 1]), share, linestyle=":", color=line.get_color())
    axis.set_xlabel("height lost [m]; dotted: the zero-moment law alone from the same draws")
    axis.set_ylabel("share of the falls")
    axis.legend(loc="lower right", fontsize=8)
    axis.grid(alpha=0.3)
