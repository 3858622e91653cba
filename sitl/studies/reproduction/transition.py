"""From forward flight to a hover, and on to the next point (report, section 5.2)."""

from __future__ import annotations

import math

import numpy as np

from sitl.hybrid.supervisor import Law
from sitl.studies import plot
from sitl.studies.report import SCENARIOS, error, settling_time
from sitl.studies.reproduction.draw import Sheet
from sitl.studies.reproduction.experiment import Experiment, Outcome, Panel, Row, Verdict, judge
from sitl.studies.reproduction.hovering import jumps_over_time, position_panel, thinned
from sitl.studies.scenario import Figure, Track, fly

NAME = "forward-to-hover"
SWITCH = 40.0  # when the second point is asked for [s]
PLACE = "5.2"


def run(seed: int) -> Outcome:
    """Figures 5.4 to 5.6, once the vehicle has a scenario that switches from forward flight to hover."""
    scenario = SCENARIOS.get(NAME)
    if scenario is None:
        nothing = Figure("[50, 0, 0], then [100, 0, 0] at 40 s", math.nan, "", "reaches both", holds=False)
        cause = "the vehicle's supervisor does not switch between forward flight and hover yet"
        return Outcome([Row(PLACE, nothing, Verdict.NOT_FLOWN, cause)], [])
    track = fly(scenario, seed=seed)
    sheets = Sheet("transition-lyapunov", height=2.8), Sheet("transition-jumps", height=1.8)
    with sheets[0] as axes:
        plot.lyapunov(axes[0], scenario, thinned(track))
        axes[0].set_xlabel("t [s]")
    with sheets[1] as axes:
        jumps_over_time(axes[0], track)
    before, after = track.lyapunov[_at(track, SWITCH - 0.1)], track.lyapunov[_at(track, SWITCH + 0.1)]
    return Outcome(_rows(track), [
        position_panel("transition", "5.4", "Position in forward flight and hover",
                       "[50, 0, 0], held; from t = 40 s [100, 0, 0].",
                       f"{error(track)[-1]:.2f} m off at the end.", track),
        Panel("5.5", "Value of the Lyapunov function, from flight to hover",
              "It jumps with the new target at t = 40 s.", f"From {before:.2g} to {after:.0f}.", sheets[0].svg),
        Panel("5.6", "Jumps, from flight to hover", "The laws are chosen in turn.",
              f"{len(track.jumps)} jumps.", sheets[1].svg),
    ])  # fmt: skip


def _rows(track: Track) -> list[Row]:
    first, second = settling_time(track, 0.5, until=SWITCH), settling_time(track, 0.5, since=SWITCH)
    forward = any(law > Law.HOVER_ZERO_MOMENT for law in np.unique(track.law))
    early = "the gains and thresholds of the report's forward law are not printed"
    return [
        judge(PLACE, Figure("reaches [50, 0, 0] after", first, "s", "before 40 s", first < SWITCH), early),
        judge(PLACE, Figure("reaches [100, 0, 0] after", second, "s", "before the end", math.isfinite(second)), early),
        judge(PLACE, Figure("error at the end", float(error(track)[-1]), "m", "0", error(track)[-1] < 0.1), early),
        judge(PLACE, Figure("flown forward", float(forward), "", "yes", forward), early),
        judge(PLACE, Figure("jumps", len(track.jumps), "", "few", len(track.jumps) <= 6), early),
    ]


def _at(track: Track, time: float) -> int:
    return int(np.searchsorted(track.time, time))


EXPERIMENT = Experiment(
    NAME,
    "From forward flight to hover",
    PLACE,
    "The vehicle arrives in forward flight at [50, 0, 0], hovers, and is sent on to [100, 0, 0] at t = 40 s.",
    run,
)
