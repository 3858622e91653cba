"""From forward flight to a hover, and on to the next point (report, section 5.2)."""

from __future__ import annotations

from sitl.studies import plot
from sitl.studies.report import SCENARIOS, SECOND, error, settling_time
from sitl.studies.reproduction.draw import Sheet
from sitl.studies.reproduction.experiment import Experiment, Outcome, Panel
from sitl.studies.reproduction.panels import jumps_over_time, position_panel, rows_of, thinned
from sitl.studies.scenario import fly

NAME, PLACE = "forward-to-hover", "5.2"


def run(seed: int) -> Outcome:
    """Figures 5.4 to 5.6."""
    scenario = SCENARIOS[NAME]
    track = fly(scenario, seed=seed)
    sheets = Sheet("transition-lyapunov", height=2.8), Sheet("transition-jumps", height=2.4)
    with sheets[0] as axes:
        plot.lyapunov(axes[0], scenario, thinned(track))
        axes[0].set_xlabel("t [s]")
    with sheets[1] as axes:
        jumps_over_time(axes[0], track)
    first, second = settling_time(track, 0.5, until=SECOND), settling_time(track, 0.5, since=SECOND)
    after = track.lyapunov[track.time > SECOND][0]
    position, laws = (
        f"Within 0.5 m after {first:.1f} s, and {second:.1f} s after the second target; {error(track)[-1]:.3f} m off "
        f"at the end. It climbs by {track.p[:, 2].max():.1f} m: level, the pitch corridor from 7 to 4.5 m/s lets it "
        "brake by no more than 0.9 m/s2.",
        f"{len(track.jumps)} jumps: on each leg alignment, transition, both forward laws and back to the linear hover "
        "law. The report has fewer laws to choose from.",
    )
    return Outcome(rows_of(PLACE, track, scenario, {}), [
        position_panel("transition", "5.4", "Position in forward flight and hover",
                       "[50, 0, 0], held; from t = 40 s [100, 0, 0].", position, track),
        Panel("5.5", "Value of the Lyapunov function, from flight to hover",
              "It jumps with the new target at t = 40 s.", f"From 0 to {after:.0f}.", sheets[0].svg),
        Panel("5.6", "Jumps, from flight to hover", "The laws are chosen in turn.", laws, sheets[1].svg),
    ])  # fmt: skip


EXPERIMENT = Experiment(
    NAME,
    "From forward flight to hover",
    PLACE,
    "The vehicle flies forward to [50, 0, 0], hovers, and is sent on to [100, 0, 0] at t = 40 s. The report switches "
    "from a linearised forward law whose gains it does not print; here the vehicle's own supervisor flies.",
    run,
)
