"""The campaign of squares with a picture: overshoot, lowest altitude and time over the wind, and some of the tracks."""

from __future__ import annotations

import argparse
import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sitl import Array, DivergedError
from sitl.lab.campaigns.campaign_run import CampaignResult
from sitl.lab.campaigns.case_flights import CaseAircraft
from sitl.lab.campaigns.specification import Case, Specification, draw
from sitl.lab.studies.spec_studies import ERROR_OPTION, GREATEST_WIND, StudyOption, fly_study
from sitl.tools.plotting import blank_page, check_plot_path, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREATEST_GUSTS = StudyOption("gusts", "vary.gusts.uniform", 10.0, is_limit=True)
SQUARE_SIDE = 100.0  # [m]
MIN_FLIGHT_HEIGHT = 5.0  # a flight that comes lower has failed [m]
DRAWN_TRACKS = 8  # flights whose ground tracks are drawn
WORST_TRACKS = 2  # of these, how many are chosen for their overshoot


def study_campaign(args: argparse.Namespace) -> int:
    """Fly the campaign; exit code 1 if too many fail or one flies too low."""
    if args.plot is not None:
        check_plot_path(args.plot)
    options = (GREATEST_WIND, GREATEST_GUSTS, ERROR_OPTION)
    draws = None if args.plot is None else lambda flown: save_plot(flown.result, args.plot)
    return fly_study(args, "square", options, then=draws)


def save_plot(result: CampaignResult, path: Path) -> None:
    """Draw overshoot, lowest altitude and time over the wind, and where some of the flights went.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 8.0)
    axes = page.subplots(2, 2)
    _scatter(axes[0, 0], result, "overshoot", "beyond the last waypoint [m]")
    _scatter(axes[0, 1], result, "lowest", "lowest altitude [m]")
    axes[0, 1].axhline(MIN_FLIGHT_HEIGHT, linestyle="--", linewidth=0.8, color="tab:red")
    _scatter(axes[1, 0], result, "duration", "time [s]")
    _tracks(axes[1, 1], result)
    save_page(page, path, dpi=90)


def _cases(result: CampaignResult) -> list[Case]:
    return [draw(result.specification, one.number) for one in result.flown]


def _scatter(axis: Axes, result: CampaignResult, measure: str, label: str) -> None:
    winds = np.array([case.values["wind"] for case in _cases(result)], float)
    values, complete = np.array(result.values(measure)), np.array(result.values("complete")) > 0.0
    for chosen, colour, name in ((complete, "tab:blue", "complete"), (~complete, "tab:red", "failed")):
        if chosen.any():
            axis.plot(winds[chosen], values[chosen], linestyle="", marker=".", color=colour, label=name)
    axis.set_xlabel("wind [m/s]")
    axis.set_ylabel(label)
    if not complete.all():
        axis.legend(loc="best", fontsize=8)
    axis.grid(alpha=0.3)


def examples(result: CampaignResult) -> list[Case]:
    """The failures first, then the greatest overshoots, then flights in order of wind."""
    told = zip(_cases(result), result.values("complete"), result.values("overshoot"), strict=True)
    flown = [(case, complete > 0.0, overshoot) for case, complete, overshoot in told]
    chosen = [case for case, complete, _ in flown if not complete][: DRAWN_TRACKS - WORST_TRACKS]
    sound = [case for case, complete, _ in sorted(flown, key=lambda one: -one[2]) if complete]
    chosen += sound[:WORST_TRACKS]
    rest = sorted(sound[WORST_TRACKS:], key=lambda case: case.values["wind"])
    count = min(DRAWN_TRACKS - len(chosen), len(rest))
    return chosen + [rest[i] for i in np.linspace(0, len(rest) - 1, count).round().astype(int)]


def track(specification: Specification, case: Case) -> Array:
    """Positions along a case that is flown again, world NWU, (n, 3) [m]."""
    aircraft = CaseAircraft(specification, case)
    with suppress(DivergedError):  # it is drawn as far as it went
        aircraft.fly()
    return aircraft.recorded.recording().position


def _tracks(axis: Axes, result: CampaignResult) -> None:
    """Ground tracks, each turned so that its first leg points up the page."""
    complete = dict(zip((one.number for one in result.flown), result.values("complete"), strict=True))
    for case in examples(result):
        p, azimuth = track(result.specification, case), float(case.values["azimuth"])
        c, s = math.cos(azimuth), math.sin(azimuth)
        along, left = c * p[:, 0] + s * p[:, 1], c * p[:, 1] - s * p[:, 0]
        failed = "" if complete[case.number] else ", failed"
        axis.plot(-left, along, linewidth=0.9, label=f"seed {case.seed}: {case.values['wind']:.1f} m/s{failed}")
    corners = SQUARE_SIDE * np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])
    axis.plot(-corners[:, 1], corners[:, 0], color="black", linestyle=":", linewidth=0.8)
    axis.set_xlabel("right of the first leg [m]")
    axis.set_ylabel("along the first leg [m]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(loc="center", fontsize=7)
    axis.grid(alpha=0.3)
