"""Scenarios as data: how a flight starts, which targets and winds come when, and which numbers are expected."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sitl import (
    Airframe,
    Array,
    DivergedError,
    JumpRecord,
    Law,
    Recording,
    Reference,
    Regime,
    Simulation,
    SitlError,
    Start,
    Tuning,
    Vector,
    along,
    at,
    hover_at,
    leg,
    load_airframe,
)
from sitl.control.governor import LINEAR
from sitl.control.reference import Point
from sitl.enclosure.arena_files import WindWall, outlet_of
from sitl.simulation.tuning import REPORT_GAIN, REPORTED
from sitl.tools.plotting import blank_page, save_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# A scenario is data: how the vehicle starts, which targets and winds come when, and which numbers are expected.
#
# Flown as fast as possible here and live in :mod:`sitl.lab.live_scenario`: the same flight, sample for sample.

ORIGIN_HEIGHT = 100.0  # the report has no ground: its origin is flown this high above ours [m]
RATE = 50.0  # recorded samples a second


class ScenarioEvent(NamedTuple):
    """A change at a time: a new target, or another wind."""

    time: float  # [s]
    target: Point | None = None  # world NWU, relative to the report's origin [m]
    wind: Point | None = None  # velocity of the air, world NWU [m/s]
    airspeed: float | None = None  # of a leg flown forward from the target before; None: hovered [m/s]


class Finding(NamedTuple):
    """One number found in a flight, with the expectation of the report or the design."""

    name: str
    value: float
    unit: str
    expected: str  # in words; empty if nothing is expected
    holds: bool  # whether the value is as expected


@dataclass(frozen=True)
class Track:
    """A recorded flight, one row per sample; positions relative to the report's origin."""

    time: Array  # (n,)
    p: Array  # (n, 3) world NWU [m]
    v: Array  # (n, 3) world NWU [m/s]
    q: Array  # (n, 4)
    actuator: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    v_hover: Array  # (n,)
    law: Array  # (n,)
    target: Array  # (n, 3)
    energy: Array  # (n,) [J]
    pointing: Array  # (n, 5) q_d and f [N] of the zero-moment law, out of date while another law flies
    jumps: tuple[JumpRecord, ...]
    wall_time: float  # how long the run took [s]
    diverged: str = ""  # why the flight ended early, empty if it did not

    @property
    def crashed(self) -> bool:
        """Whether it hit the ground too fast."""
        return any(jump.target is Law.CRASHED for jump in self.jumps)


# What the report flies: Q = R = I, and both forward laws.
AS_REPORTED = Tuning(controller=REPORTED, design=REPORT_GAIN, v_enter=20.0, v_leave=50.0, forward_linear=1)


@dataclass(frozen=True)
class Scenario:
    """One experiment."""

    name: str
    title: str
    claim: str  # of the report about it
    start: Start  # relative to the report's origin
    events: tuple[ScenarioEvent, ...]
    duration: float  # [s]
    findings: Callable[[Track], list[Finding]]
    law: Law = Law.HOVER_ZERO_MOMENT  # in force at the start
    airframe: str = "nominal"
    speed: float = 3.0  # horizontal speed limit [m/s]
    tuning: Tuning = AS_REPORTED
    wall: WindWall | None = None  # relative to the report's origin

    def start_in_air(self) -> Start:
        """The start above our ground."""
        return self.start._replace(up=self.start.up + ORIGIN_HEIGHT, airborne=True)

    def put_wall(self, vehicle: Simulation) -> None:
        """Have the scenario's wind wall blow, if it has one."""
        if self.wall is not None:
            outlet = self.wall.outlet
            raised = Vector(outlet.centre.x, outlet.centre.y, outlet.centre.z + ORIGIN_HEIGHT)
            vehicle.surroundings.put_wall(self.wall._replace(outlet=outlet._replace(centre=raised)))

    def first_reference(self) -> Reference:
        """A hover at the origin, in force until the first target."""
        return hover_at((0.0, 0.0, ORIGIN_HEIGHT), self.start.heading, self.speed)


def fly(
    scenario: Scenario, *, seed: int = 1, airframe: str | Airframe | None = None, keep_diverged: bool = False
) -> Track:
    """Fly a scenario as fast as possible.

    Args:
        scenario: What to fly.
        seed: Of the gusts.
        airframe: Parameter set, TOML file, or the parameters themselves; by default the scenario's own set.
        keep_diverged: Whether to return the track of a diverged flight, which ends early, instead of raising.

    Raises:
        DivergedError: If the state of the vehicle stops being finite.
        SitlError: If the airframe is unknown or the scenario has no duration.
    """
    parameters = airframe if isinstance(airframe, Airframe) else load_airframe(airframe or scenario.airframe).parameters
    vehicle = Simulation(parameters, seed=seed, start=scenario.start_in_air(), tuning=scenario.tuning)
    vehicle.begin_flight(scenario.law)
    scenario.put_wall(vehicle)
    vehicle.warm_up()
    began = time.perf_counter()
    parts: list[Recording] = []
    reference, fault = scenario.first_reference(), ""
    events = sorted(scenario.events)
    while vehicle.time < scenario.duration - 1e-9 and not fault:
        while events and events[0].time <= vehicle.time + 1e-9:
            event = events.pop(0)
            if event.target is not None:
                reference = next_reference(reference, event.target, event.airspeed)
            if event.wind is not None:
                vehicle.set_wind(event.wind)
        vehicle.reference = reference
        until = min(events[0].time if events else math.inf, scenario.duration)
        try:
            parts.append(vehicle.record(whole_samples(until - vehicle.time), RATE))
        except DivergedError as error:
            if not keep_diverged or error.recording is None:
                raise
            parts.append(error.recording)
            fault = str(error)
    return joined(parts, tuple(vehicle.jumps), time.perf_counter() - began, fault)


def whole_samples(seconds: float) -> float:
    """A time rounded up to whole samples [s]."""
    return math.ceil(round(seconds * RATE, 6)) / RATE


def next_reference(last: Reference, target: Point, airspeed: float | None) -> Reference:
    """The reference of a new target.

    Args:
        last: The reference before.
        target: World NWU, relative to the report's origin [m].
        airspeed: Of a leg that is flown forward from the last target [m/s]; None: hover there.
    """
    end = (target[0], target[1], target[2] + ORIGIN_HEIGHT)
    if airspeed is None:
        return at(last, end)
    return along(last, leg(last.position, end, airspeed), last.heading)


def joined(parts: list[Recording], jumps: tuple[JumpRecord, ...], wall_time: float, diverged: str = "") -> Track:
    """Consecutive recordings as one track relative to the report's origin.

    Args:
        parts: The recordings in order.
        jumps: Of the whole flight.
        wall_time: How long the run took [s].
        diverged: Why it ended early; empty if it did not.

    Raises:
        SitlError: If there is no recording.
    """
    if not parts:
        raise SitlError("the scenario has no duration: nothing was flown")

    def whole(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    origin = np.array((0.0, 0.0, ORIGIN_HEIGHT))
    return Track(
        time=whole("time"),
        p=whole("position") - origin,
        v=whole("velocity"),
        q=whole("attitude"),
        actuator=whole("actuators"),
        v_hover=whole("v_hover"),
        law=whole("law"),
        target=whole("reference") - origin,
        energy=whole("energy"),
        pointing=whole("pointing"),
        jumps=jumps,
        wall_time=wall_time,
        diverged=diverged,
    )


def as_text(scenario: Scenario, track: Track, findings: list[Finding]) -> str:
    """A flight's findings with their verdicts, its jumps, and how fast it ran."""
    lines = [f"{scenario.name}: {scenario.title}", f"  {scenario.claim}"]
    for finding in findings:
        verdict = "" if not finding.expected else f"   [{'ok' if finding.holds else 'MISSED'}: {finding.expected}]"
        lines.append(f"  {finding.name:<32}{finding.value:10.3f} {finding.unit:<6}{verdict}")
    lines += [
        f"  jump {jump.number} at {jump.time:.2f} s: {jump.source.name} -> {jump.target.name} ({jump.name})"
        for jump in track.jumps
    ]
    lines += ["  CRASHED"] if track.crashed else []
    speed = scenario.duration / track.wall_time
    lines.append(f"  {scenario.duration:.0f} s flown in {track.wall_time:.2f} s: {speed:.0f}x real time")
    return "\n".join(lines)


# The flights of the report under the vehicle's supervisor, with the numbers the report gives for them.


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
            airframe="collage",
            tuning=Tuning(controller=REPORTED),
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


# A page per flight: position, attitude, the Lyapunov value with the jumps, and the actuators.


def save_plot(scenario: Scenario, track: Track, path: Path) -> None:
    """Draw position, attitude, V with its thresholds and jumps, and the actuators.

    Raises:
        SitlError: If matplotlib is missing or the file cannot be written.
    """
    page = blank_page(10.0, 11.0)
    axes = page.subplots(5, 1, sharex=True)
    page.suptitle(f"{scenario.title}\n{scenario.claim}", fontsize=10)
    position(axes[0], track)
    attitude(axes[1], track)
    lyapunov(axes[2], scenario, track)
    actuators((axes[3], axes[4]), track.time, track.actuator)
    axes[4].set_xlabel("t [s]")
    save_page(page, path, dpi=110)


def lines(axis: Axes, time: Array, columns: Array, labels: tuple[str, ...], unit: str) -> None:
    """One line per column of (n, k) over time, with a legend."""
    for column, label in zip(columns.T, labels, strict=True):
        axis.plot(time, column, label=label, linewidth=1.0)
    axis.set_ylabel(unit)
    axis.legend(loc="right", fontsize=8)
    axis.grid(alpha=0.3)


def actuators(axes: tuple[Axes, Axes], time: Array, actuator: Array) -> None:
    """Propeller speeds above, elevons below, of (n, 4) in rad/s and rad."""
    lines(axes[0], time, actuator[:, :2], ("left", "right"), "motors [rad/s]")
    lines(axes[1], time, np.degrees(actuator[:, 2:]), ("left", "right"), "elevons [deg]")


def position(axis: Axes, track: Track) -> None:
    """Position, the target dotted."""
    lines(axis, track.time, track.p, ("north", "west", "up"), "position [m]")
    axis.set_prop_cycle(None)
    axis.plot(track.time, track.target, linestyle=":", linewidth=1.0)


def attitude(axis: Axes, track: Track) -> None:
    """The nose's elevation: the one angle that means the same in hover and in flight."""
    axis.plot(track.time, np.degrees(nose_elevation(track)), linewidth=1.0)
    axis.set_ylabel("nose elevation [deg]")
    axis.grid(alpha=0.3)


def lyapunov(axis: Axes, scenario: Scenario, track: Track) -> None:
    """V with its thresholds, the jumps, and where the linear law flies."""
    axis.semilogy(track.time, np.maximum(track.v_hover, 1e-6), linewidth=1.0)
    for value in (scenario.tuning.v_enter, scenario.tuning.v_leave):
        axis.axhline(value, linestyle="--", linewidth=0.8, color="grey")
    for jump in track.jumps:
        axis.axvline(jump.time, linewidth=0.8, color="tab:red")
    linear = track.law == Law.HOVER_LINEAR
    axis.fill_between(
        track.time, 0, 1, where=linear, transform=axis.get_xaxis_transform(), alpha=0.12, label="linear law"
    )
    axis.set_ylabel("V")
    axis.legend(loc="right", fontsize=8)
    axis.grid(alpha=0.3)
