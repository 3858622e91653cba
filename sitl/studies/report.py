"""The flights of the report under the vehicle's supervisor, with the figures it prints of them."""

from __future__ import annotations

import math

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.control.governor import LINEAR
from sitl.model.airframe import Array
from sitl.simulation.simulation import Start, Tuning
from sitl.studies.scenario import Ask, Figure, Scenario, Track

WIND_FROM = 10.0  # when the wind of the LQI experiment begins [s]
FORWARD = (Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR)
SECOND = 40.0  # when the transition experiment's second target comes [s]


def settling_time(track: Track, radius: float, since: float = 0.0, until: float = math.inf) -> float:
    """Time after which the position error stays below a radius [s]; NaN if it never does.

    Args:
        track: The flight.
        radius: [m].
        since: Only look from this time on, and count from it [s].
        until: Only look up to this time [s].
    """
    window = (track.time >= since) & (track.time < until)
    outside = np.flatnonzero(error(track)[window] > radius)
    times = track.time[window]
    if outside.size == 0:
        return 0.0
    if outside[-1] + 1 == times.size:
        return math.nan
    return float(times[outside[-1] + 1] - since)


def error(track: Track) -> Array:
    """Distance to the target over the flight, (n,) [m]."""
    return np.asarray(np.linalg.norm(track.p - track.target, axis=1))


def jumps_between(track: Track, since: float, until: float, to: Law) -> int:
    """How many jumps into a law fell in a time window."""
    return sum(since <= jump.time < until and jump.target is to for jump in track.jumps)


def _hover(track: Track) -> list[Figure]:
    settled = settling_time(track, 0.05)
    return [
        Figure(
            "within 0.25 m after",
            settling_time(track, 0.25),
            "s",
            "about 5 s",
            settling_time(track, 0.25) < 5.0,
        ),
        Figure("within 0.05 m after", settled, "s", "about 5 s", settled < 6.0),
        Figure("error at the end", float(error(track)[-1]), "m", "0", error(track)[-1] < 0.02),
        Figure("greatest speed", float(np.linalg.norm(track.v, axis=1).max()), "m/s", "", True),
    ]


def _far(track: Track) -> list[Figure]:
    out = settling_time(track, 0.5, until=100.0)
    back = settling_time(track, 0.5, since=100.0)
    entries_out = jumps_between(track, 0.0, 100.0, Law.HOVER_LINEAR)
    entries_back = jumps_between(track, 100.0, math.inf, Law.HOVER_LINEAR)
    return [
        Figure("reaches [100, 100, 50] after", out, "s", "before 100 s", out < 100.0),
        Figure("reaches [0, 0, 0] after", back, "s", "before the end", not math.isnan(back)),
        Figure("jumps NL -> L, way out", entries_out, "", "1", entries_out == 1),
        Figure("jumps NL -> L, way back", entries_back, "", "1", entries_back == 1),
        Figure("jumps in all", len(track.jumps), "", "3", len(track.jumps) == 3),
        Figure("greatest V", float(track.lyapunov.max()), "", "", True),
        Figure("error at the end", float(error(track)[-1]), "m", "0", error(track)[-1] < 0.05),
    ]


def _wind(track: Track) -> list[Figure]:
    after = track.time >= WIND_FROM
    nose = nose_elevation(track)[-1]
    speed, calm = track.actuator[-1, 0], track.actuator[after, 0][0]
    return [
        Figure(
            "greatest deviation",
            float(error(track)[after].max()),
            "m",
            "bounded",
            error(track)[after].max() < 2.0,
        ),
        Figure("error at the end", float(error(track)[-1]), "m", "0", error(track)[-1] < 0.05),
        Figure(
            "nose above the horizon",
            math.degrees(nose),
            "deg",
            "about 60",
            abs(math.degrees(nose) - 62.0) < 5.0,
        ),
        Figure("motor speed in calm", float(calm), "rad/s", "", True),
        Figure("motor speed in wind", float(speed), "rad/s", "lower", speed < calm),
        Figure("elevon in wind", math.degrees(track.actuator[-1, 2]), "deg", "constant", True),
    ]


def _transition(track: Track) -> list[Figure]:
    first, second = settling_time(track, 0.5, until=SECOND), settling_time(track, 0.5, since=SECOND)
    on_the_wing = float(np.isin(track.law, FORWARD).sum() * (track.time[1] - track.time[0]))
    before, after = track.lyapunov[track.time < SECOND][-1], track.lyapunov[track.time > SECOND][0]
    return [
        Figure("reaches [50, 0, 0] after", first, "s", "before 40 s", first < SECOND),
        Figure("hovers there, V at 40 s", float(before), "", "0", before < 1e-3),
        Figure("V with the new target", float(after), "", "jumps", after > 1.0),
        Figure("reaches [100, 0, 0] after", second, "s", "before the end", not math.isnan(second)),
        Figure("error at the end", float(error(track)[-1]), "m", "0", error(track)[-1] < 0.05),
        Figure("under a forward law", on_the_wing, "s", "flown", on_the_wing > 0.0),
        Figure("height gained while slowing down", float(track.p[:, 2].max()), "m", "", True),
        Figure("jumps in all", len(track.jumps), "", "", True),
    ]


def nose_elevation(track: Track) -> Array:
    """Angle of the nose above the horizon over the flight, (n,) [rad]."""
    q = track.q
    return np.asarray(np.arcsin(np.clip(2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2]), -1.0, 1.0)))


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            name="hover",
            title="Zero-moment hover law to [5, 5, 5]",
            claim="section 3.2.2: from roll 10, pitch -45, yaw 25 deg it converges in about five seconds",
            start=Start(attitude=(math.radians(10.0), math.radians(-45.0), math.radians(25.0))),
            asks=(Ask(0.0, target=(5.0, 5.0, 5.0)),),
            duration=10.0,
            figures=_hover,
            tuning=Tuning(v_enter=0.0, v_leave=math.inf, governor=LINEAR),  # this law alone, as in the report
        ),
        Scenario(
            name="far-target",
            title="Hybrid hover to [100, 100, 50] and back",
            claim="section 5.1: the zero-moment law flies the distance, the linear law takes over near the target",
            start=Start(),
            asks=(Ask(0.0, target=(100.0, 100.0, 50.0)), Ask(100.0, target=(0.0, 0.0, 0.0))),
            duration=200.0,
            figures=_far,
        ),
        Scenario(
            name="lqi-wind",
            title="LQI holds position in a 5 m/s wind from t = 10 s",
            claim="section 3.1.4: no static error, the nose tips to about 60 deg, the motors slow down",
            start=Start(),
            asks=(Ask(0.0, target=(0.0, 0.0, 0.0)), Ask(WIND_FROM, wind=(-5.0, 0.0, 0.0))),
            duration=60.0,
            figures=_wind,
            law=Law.HOVER_LINEAR,
        ),
        Scenario(
            name="forward-to-hover",
            title="From forward flight to hover at [50, 0, 0], then on to [100, 0, 0]",
            claim="section 5.2: it stabilises in hover; V jumps with the new target at t = 40 s",
            start=Start(),
            asks=(
                Ask(0.0, target=(50.0, 0.0, 0.0), airspeed=10.0),
                Ask(SECOND, target=(100.0, 0.0, 0.0), airspeed=10.0),
            ),
            duration=80.0,
            figures=_transition,
        ),
    )
}
