"""From forward flight to a hover, and on to the next point (report, section 5.2)."""

from __future__ import annotations

import numpy as np

from sitl import Actuators, Airframe, Body, Law, Simulation, Start, Vector, along, hover_at, leg
from sitl.design.trim import level_trim
from sitl.lab.reproduction.expectation import above, printed
from sitl.lab.reproduction.experiment import Conditions, Experiment, ExperimentResult, Illustration, Statement
from sitl.lab.reproduction.experiments.hover_flights import farthest
from sitl.lab.reproduction.flight_panels import jumps_panel, listed, lyapunov_panel, position_panel
from sitl.lab.scenarios.catalogue import SECOND_TARGET_TIME, settling_time
from sitl.lab.scenarios.scenario import AS_REPORTED, ORIGIN_HEIGHT, RATE, Track, joined, next_reference
from sitl.model.quaternions import from_euler

CRUISE_SPEED = 10.0  # of the trimmed flight it begins in [m/s]
TARGETS = ((50.0, 0.0, 0.0), (100.0, 0.0, 0.0))
DURATION = 80.0  # [s]


def fly_from_cruise(a: Airframe, seed: int) -> Track:
    """Begin at the origin in trimmed level flight under the linear forward law; stop at the first target, fly on.

    Args:
        a: The airframe.
        seed: Of sensor noise.
    """
    origin = Vector(0.0, 0.0, ORIGIN_HEIGHT)
    vehicle = Simulation(a, seed=seed, start=Start(up=ORIGIN_HEIGHT, airborne=True), tuning=AS_REPORTED)
    vehicle.begin_flight(Law.HOVER_ZERO_MOMENT)
    trim = level_trim(a, CRUISE_SPEED)
    still, ahead = Vector(0.0, 0.0, 0.0), Vector(CRUISE_SPEED, 0.0, 0.0)
    trimmed = Actuators(trim.omega, trim.omega, trim.delta, trim.delta)
    vehicle.place(Body(origin, ahead, from_euler(0.0, -trim.theta, 0.0), still), trimmed)
    first = (TARGETS[0][0], TARGETS[0][1], TARGETS[0][2] + ORIGIN_HEIGHT)
    vehicle.reference = along(hover_at(origin, 0.0), leg(origin, first, CRUISE_SPEED), 0.0)
    vehicle.enter(Law.FORWARD_LINEAR)
    parts = [vehicle.record(SECOND_TARGET_TIME, RATE)]
    vehicle.reference = next_reference(vehicle.reference, TARGETS[1], CRUISE_SPEED)
    parts.append(vehicle.record(DURATION - SECOND_TARGET_TIME, RATE))
    return joined(parts, tuple(vehicle.jumps), 0.0)


def run(conditions: Conditions) -> ExperimentResult:
    """Figures 5.4 to 5.6."""
    track = fly_from_cruise(conditions.airframe("nominal"), conditions.seed)
    last = int(np.searchsorted(track.time, SECOND_TARGET_TIME - 0.5 / RATE)) - 1
    before, after = track.lyapunov[last], track.lyapunov[last + 2]
    speed = float(np.linalg.norm(track.v[last]))
    statements = [
        Statement("5.2", "[50, 0, 0] is reached from forward flight: off at t = 40 s, worst axis", printed("0"),
                  farthest(track, track.time[last]), "m"),
        Statement("5.2", "it hovers there: speed at t = 40 s", printed("0"), speed, "m/s"),
        Statement("5.2", "V with the new target over V before", above(1.0, "jumps"), float(after / before)),
        Statement("5.2", "[100, 0, 0] is reached: off at the end, worst axis", printed("0"),
                  farthest(track, track.time[-1]), "m"),
    ]  # fmt: skip
    first = settling_time(track, 0.5, until=SECOND_TARGET_TIME)
    second = settling_time(track, 0.5, since=SECOND_TARGET_TIME)
    position = (
        f"It begins in trimmed level flight at {CRUISE_SPEED:.0f} m/s. Within 0.5 m after {first:.1f} s, and "
        f"{second:.1f} s after the second target. It climbs by {track.p[:, 2].max():.1f} m: level, the pitch corridor "
        "lets it brake too little."
    )
    illustration = Illustration(
        "5.2", "jumps in all", float(len(track.jumps)), "", "the laws are chosen in turn",
        f"{listed(track.jumps)}: the vehicle's own supervisor, as the report prints neither its forward gains nor "
        "where the flight begins",
    )  # fmt: skip
    ours = np.array([AS_REPORTED.v_enter, AS_REPORTED.v_leave])
    return ExperimentResult(statements, [
        position_panel("transition", "5.4", "Position in forward flight and hover",
                       "[50, 0, 0], held; from t = 40 s [100, 0, 0].", position, track),
        lyapunov_panel("5.5", "Value of the Lyapunov function, from flight to hover",
                       "It jumps with the new target at t = 40 s.", f"From {before:.1e} to {after:.0f}.", "transition",
                       track, ours),
        jumps_panel("5.6", "Jumps, from flight to hover", "The laws are chosen in turn.",
                    f"{len(track.jumps)} jumps, from forward flight on.", "transition", track),
    ], [illustration])  # fmt: skip


BACK_TRANSITION = Experiment(
    "forward-to-hover",
    "From forward flight to hover",
    "5.2",
    "The vehicle begins in trimmed level flight under the linear forward law, stops and hovers at [50, 0, 0], and is "
    "sent on to [100, 0, 0] at t = 40 s. The same-named live scenario begins in the hover instead.",
    run,
    airframes=("nominal",),
)
