"""From forward flight to a hover, and on to the next point (report, section 5.2)."""

from __future__ import annotations

from sitl.reproduction.experiment import Experiment, ExperimentResult, Panel
from sitl.reproduction.flight_panels import jumps_over_time, position_panel, statements_of, thinned
from sitl.reproduction.svg_sheet import SvgSheet
from sitl.scenarios import flight_plot
from sitl.scenarios.catalogue import SCENARIOS, SECOND_TARGET_TIME, position_error, settling_time
from sitl.scenarios.scenario import fly


def run(seed: int) -> ExperimentResult:
    """Figures 5.4 to 5.6."""
    scenario = SCENARIOS["forward-to-hover"]
    track = fly(scenario, seed=seed)
    sheets = SvgSheet("transition-lyapunov", height=2.8), SvgSheet("transition-jumps", height=2.4)
    with sheets[0] as axes:
        flight_plot.lyapunov(axes[0], scenario, thinned(track))
        axes[0].set_xlabel("t [s]")
    with sheets[1] as axes:
        jumps_over_time(axes[0], track)
    first = settling_time(track, 0.5, until=SECOND_TARGET_TIME)
    second = settling_time(track, 0.5, since=SECOND_TARGET_TIME)
    after = track.lyapunov[track.time > SECOND_TARGET_TIME][0]
    position = (
        f"Within 0.5 m after {first:.1f} s, and {second:.1f} s after the second target; "
        f"{position_error(track)[-1]:.3f} m off at the end. It climbs by {track.p[:, 2].max():.1f} m: level, the pitch "
        "corridor from 7 to 4.5 m/s lets it brake by no more than 0.9 m/s2."
    )
    laws = (
        f"{len(track.jumps)} jumps: on each leg alignment, transition, both forward laws and back to the linear hover "
        "law. The report has fewer laws to choose from."
    )
    return ExperimentResult(statements_of("5.2", track, scenario, {}), [
        position_panel("transition", "5.4", "Position in forward flight and hover",
                       "[50, 0, 0], held; from t = 40 s [100, 0, 0].", position, track),
        Panel("5.5", "Value of the Lyapunov function, from flight to hover",
              "It jumps with the new target at t = 40 s.", f"From 0 to {after:.0f}.", sheets[0].svg),
        Panel("5.6", "Jumps, from flight to hover", "The laws are chosen in turn.", laws, sheets[1].svg),
    ])  # fmt: skip


BACK_TRANSITION = Experiment(
    "forward-to-hover",
    "From forward flight to hover",
    "5.2",
    "The vehicle flies forward to [50, 0, 0], hovers, and is sent on to [100, 0, 0] at t = 40 s. The report switches "
    "from a linearised forward law whose gains it does not print; here the vehicle's own supervisor flies.",
    run,
)
