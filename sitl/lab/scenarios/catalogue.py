"""The flights of the report under the vehicle's supervisor, with the numbers the report gives for them."""

from __future__ import annotations

import math

import numpy as np

from sitl import Array, Law, Regime, Start, Tuning
from sitl.control.governor import LINEAR
from sitl.enclosure.arena_files import WindWall, outlet_of
from sitl.lab.scenarios.scenario import AS_REPORTED, Finding, Scenario, ScenarioEvent, Track

WIND_START = 10.0  # of the LQI experiment [s]
JET_GUSTS = (25.0, 35.0)  # of the experiment before a wind wall [s]
SECOND_TARGET_TIME = 40.0  # of the transition experiment [s]


def settling_time(track: Track, radius: float, since: float = 0.0, until: float = math.inf) -> float:
    """Time after which the position error stays below a radius [s]; NaN if it never does.

    Args:
        track: The flight.
        radius: [m].
        since: Start of the window, from which the time is counted [s].
        until: End of the window [s].
    """
    window = (track.time >= since) & (track.time < until)
    outside = np.flatnonzero(position_error(track)[window] > radius)
    times = track.time[window]
    if outside.size == 0:
        return 0.0
    if outside[-1] + 1 == times.size:
        return math.nan
    return float(times[outside[-1] + 1] - since)


def position_error(track: Track) -> Array:
    """Distance to the target over the flight, (n,) [m]."""
    return np.asarray(np.linalg.norm(track.p - track.target, axis=1))


def jumps_between(track: Track, since: float, until: float, to: Law) -> int:
    """Number of jumps into a law in a time window."""
    return sum(since <= jump.time < until and jump.target is to for jump in track.jumps)


def _hover(track: Track) -> list[Finding]:
    near, settled = settling_time(track, 0.25), settling_time(track, 0.05)
    return [
        Finding("within 0.25 m after", near, "s", "about 5 s", near < 5.0),
        Finding("within 0.05 m after", settled, "s", "about 5 s", settled < 6.0),
        Finding("error at the end", float(position_error(track)[-1]), "m", "0", position_error(track)[-1] < 0.02),
        Finding("greatest speed", float(np.linalg.norm(track.v, axis=1).max()), "m/s", "", True),
    ]


def _far(track: Track) -> list[Finding]:
    out = settling_time(track, 0.5, until=100.0)
    back = settling_time(track, 0.5, since=100.0)
    entries_out = jumps_between(track, 0.0, 100.0, Law.HOVER_LINEAR)
    entries_back = jumps_between(track, 100.0, math.inf, Law.HOVER_LINEAR)
    return [
        Finding("reaches [100, 100, 50] after", out, "s", "before 100 s", out < 100.0),
        Finding("reaches [0, 0, 0] after", back, "s", "before the end", not math.isnan(back)),
        Finding("jumps NL -> L, way out", entries_out, "", "1", entries_out == 1),
        Finding("jumps NL -> L, way back", entries_back, "", "1", entries_back == 1),
        Finding("jumps in all", len(track.jumps), "", "3", len(track.jumps) == 3),
        Finding("greatest V", float(track.v_hover.max()), "", "", True),
        Finding("error at the end", float(position_error(track)[-1]), "m", "0", position_error(track)[-1] < 0.05),
    ]


def _wind(track: Track) -> list[Finding]:
    after = track.time >= WIND_START
    nose = math.degrees(nose_elevation(track)[-1])
    error = position_error(track)
    speed, calm = track.actuator[-1, 0], track.actuator[after, 0][0]
    return [
        Finding("greatest deviation", float(error[after].max()), "m", "bounded", error[after].max() < 2.0),
        Finding("error at the end", float(error[-1]), "m", "0", error[-1] < 0.05),
        Finding("nose above the horizon", nose, "deg", "about 60", abs(nose - 62.0) < 5.0),
        Finding("motor speed in calm", float(calm), "rad/s", "", True),
        Finding("motor speed in wind", float(speed), "rad/s", "lower", speed < calm),
        Finding("elevon in wind", math.degrees(track.actuator[-1, 2]), "deg", "constant", True),
    ]


def _jet(track: Track) -> list[Finding]:
    error = position_error(track)
    steady = error[(track.time >= JET_GUSTS[0] - 5.0) & (track.time < JET_GUSTS[0])]
    worst = [float(error[(track.time >= at) & (track.time < at + 8.0)].max()) for at in JET_GUSTS]
    return [
        Finding("error in the steady jet", float(steady.max()), "m", "small", steady.max() < 0.15),
        Finding("greatest error in the first gust", worst[0], "m", "bounded", worst[0] < 0.6),
        Finding("greatest error in the second gust", worst[1], "m", "bounded", worst[1] < 0.6),
        Finding("error at the end", float(error[-1]), "m", "small", error[-1] < 0.15),
    ]


def _transition(track: Track) -> list[Finding]:
    first = settling_time(track, 0.5, until=SECOND_TARGET_TIME)
    second = settling_time(track, 0.5, since=SECOND_TARGET_TIME)
    forward_laws = [law for law in Law if law.regime is Regime.FORWARD]
    forward_time = float(np.isin(track.law, forward_laws).sum() * (track.time[1] - track.time[0]))
    before = track.v_hover[track.time < SECOND_TARGET_TIME][-1]
    after = track.v_hover[track.time > SECOND_TARGET_TIME][0]
    return [
        Finding("reaches [50, 0, 0] after", first, "s", "before 40 s", first < SECOND_TARGET_TIME),
        Finding("hovers there, V at 40 s", float(before), "", "0", before < 1e-3),
        Finding("V with the new target", float(after), "", "jumps", after > 1.0),
        Finding("reaches [100, 0, 0] after", second, "s", "before the end", not math.isnan(second)),
        Finding("error at the end", float(position_error(track)[-1]), "m", "0", position_error(track)[-1] < 0.05),
        Finding("under a forward law", forward_time, "s", "flown", forward_time > 0.0),
        Finding("height gained while slowing down", float(track.p[:, 2].max()), "m", "", True),
        Finding("jumps in all", len(track.jumps), "", "", True),
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
            events=(ScenarioEvent(0.0, target=(5.0, 5.0, 5.0)),),
            duration=10.0,
            findings=_hover,
            # This law alone, as in the report.
            tuning=AS_REPORTED._replace(v_enter=0.0, v_leave=math.inf, governor=LINEAR),
        ),
        Scenario(
            name="far-target",
            title="Hybrid hover to [100, 100, 50] and back",
            claim="section 5.1: the zero-moment law flies the distance, the linear law takes over near the target",
            start=Start(),
            events=(ScenarioEvent(0.0, target=(100.0, 100.0, 50.0)), ScenarioEvent(100.0, target=(0.0, 0.0, 0.0))),
            duration=200.0,
            findings=_far,
        ),
        Scenario(
            name="lqi-wind",
            title="LQI holds position in a 5 m/s wind from t = 10 s",
            claim="section 3.1.4: no static error, the nose tips to about 60 deg, the motors slow down",
            start=Start(),
            events=(ScenarioEvent(0.0, target=(0.0, 0.0, 0.0)), ScenarioEvent(WIND_START, wind=(-5.0, 0.0, 0.0))),
            duration=60.0,
            findings=_wind,
            law=Law.HOVER_LINEAR,
        ),
        Scenario(
            name="jet-gust",
            title="Gusts of 1.5 m/s in the 3 m/s jet of a wind wall",
            claim="as section 3.1.4 in a flight cage: a wall 4.5 m before it blows with turbulence, and in two gusts",
            start=Start(),
            events=(ScenarioEvent(0.0, target=(0.0, 0.0, 0.0)),),
            duration=50.0,
            findings=_jet,
            law=Law.HOVER_LINEAR,
            airframe="physical",
            tuning=Tuning(),
            wall=WindWall(
                outlet_of(4.5, 0.0, 0.0, math.pi, 3.0, 3.0),
                intensity=0.05,
                length=0.25,
                schedule=((0.0, 0.0), (WIND_START, 0.0), (WIND_START + 1.0, 3.0)),
                bursts=tuple((at, 2.0, 1.5) for at in JET_GUSTS),
            ),
        ),
        Scenario(
            name="forward-to-hover",
            title="From forward flight to hover at [50, 0, 0], then on to [100, 0, 0]",
            claim="section 5.2: it stabilises in hover; V jumps with the new target at t = 40 s",
            start=Start(),
            events=(
                ScenarioEvent(0.0, target=(50.0, 0.0, 0.0), airspeed=10.0),
                ScenarioEvent(SECOND_TARGET_TIME, target=(100.0, 0.0, 0.0), airspeed=10.0),
            ),
            duration=80.0,
            findings=_transition,
        ),
    )
}
