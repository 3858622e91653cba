"""Returns and landings that are asked for anywhere on the way past home: how they end, and what they do before it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from protocol.names.modes import Mode
from sitl import Aircraft, Configuration, DivergedError, Law, Regime, Settings, Start, Vector, WorldSettings
from sitl.autopilot.arming import MAX_STANDING_TILT
from sitl.control.reference import Point
from sitl.lab.studies.craft import Craft
from sitl.lab.studies.landings import on_drawn_ground
from sitl.lab.studies.mission_flight import STUDY_WORLD
from sitl.model.ground import GroundPlane, height_over, is_touching
from sitl.model.quaternions import x_axis

ALONG, ASIDE, LOWEST_ASKED, HIGHEST_ASKED = 60.0, 30.0, 4.0, 60.0  # where it is asked for, home being the origin [m]
MAX_BEFORE, MAX_AFTER = 200.0, 300.0  # of the leg, before that place and after it [m]
MIN_LEG = 60.0  # shorter ones are hovered [m]
SETTLING_PERIODS = 2500  # in the hover before the leg: the wind is known then
LANDING_SAMPLE_PERIODS = 5  # control periods between two looks
MAX_TIME_TO_MARK, MAX_ASKED_TIME = 60.0, 300.0  # [s]
TOUCH_AND_GO = 0.1  # what rises so far after a touch has gone up again: the next touch counts [m]
STANDING_PERIODS = 1500  # looked at after the landing: it may still fall over
MAX_UNNOTICED = 1.0  # from the first touch until the motors idle [s]
STANDING_COSINE = math.cos(MAX_STANDING_TILT)
ASKED_PER_TASK = 4  # handed to a worker process at once


class AskedLandingEnd(StrEnum):
    """End of a return or landing; all but the first are lost."""

    UPRIGHT = "upright"
    TIPPED = "tipped over"
    CRASHED = "crashed"
    IN_THE_AIR = "stopped in the air"
    LATE = "late"


class AskedLanding(NamedTuple):
    """Result of one return or landing."""

    seed: int
    request: str  # RTL or LAND
    place: Point  # where it was asked for, home being the origin [m]
    wind: float  # [m/s]
    law: str  # in force when it was asked for
    end: AskedLandingEnd
    low: float  # lowest of its centre of mass over the ground while it was not upright [m]
    unnoticed: float  # from the first touch until the motors idle [s]
    slid: float  # on the ground, until it stands [m]
    sink: float  # at the first touch [m/s]
    level: float  # speed over the ground there [m/s]
    off: float  # where it stands: from home, or from where the landing was asked for [m]
    time: float  # from the request until it stands [s]
    ground: float  # height of the ground there, above home [m]

    @property
    def is_good(self) -> bool:
        """Whether it stands, and the ground was noticed soon."""
        return self.end is AskedLandingEnd.UPRIGHT and self.unnoticed <= MAX_UNNOTICED


class _Draw(NamedTuple):
    """Request, start, target and wind drawn for one flight."""

    request: str
    start: Point
    target: Point
    course: float  # of the leg, world NWU [rad]
    mark: float  # how far along the course the request comes, home being 0 [m]
    wind: float  # [m/s]
    gusts: float  # [m/s]
    wind_from: float  # [deg]


def _drawn(seed: int, wind: float, gusts: float) -> _Draw:
    """Draw a flight; every second one is calm, and of two such pairs one returns and one lands."""
    random = np.random.default_rng((seed, 31))
    course = float(random.uniform(-math.pi, math.pi))
    mark, aside = float(random.uniform(-ALONG, ALONG)), float(random.uniform(-ASIDE, ASIDE))
    height = float(random.uniform(LOWEST_ASKED, HIGHEST_ASKED))
    before, after = float(random.uniform(3.0, MAX_BEFORE)), float(random.uniform(3.0, MAX_AFTER))
    before += max(MIN_LEG - before - after, 0.0)
    wind_from = float(random.uniform(-180.0, 180.0))
    c, s = math.cos(course), math.sin(course)

    def at(along: float) -> Point:
        return (along * c - aside * s, along * s + aside * c, height)

    blows = seed % 2 == 0
    return _Draw(
        "RTL" if seed // 2 % 2 else "LAND",
        at(mark - before),
        at(mark + after),
        course,
        mark,
        wind if blows else 0.0,
        gusts if blows else 0.0,
        wind_from,
    )


def _above(ground: GroundPlane, draw: _Draw) -> _Draw:
    """The same flight above the highest ground of its leg and of home, instead of level ground at home's height."""
    on_leg = (*(Vector(*point[:2], 0.0) for point in (draw.start, draw.target)), Vector(0.0, 0.0, 0.0))
    higher = max(-height_over(ground, point) for point in on_leg)
    start, target = ((north, west, up + higher) for north, west, up in (draw.start, draw.target))
    return draw._replace(start=start, target=target)


def fly(seed: int, craft: Craft, wind: float, gusts: float, slope: float = 0.0, ground: float = 0.0) -> AskedLanding:
    """Fly one.

    Args:
        seed: Of the flight, where the ground rises, the gusts and the sensors.
        craft: What is flown.
        wind: Steady wind of every second flight [m/s]; the others are calm.
        gusts: Of those, rms per axis [m/s].
        slope: Of the ground [deg].
        ground: Its height above home, at home [m].
    """
    draw = _drawn(seed, wind, gusts)
    world = on_drawn_ground(WorldSettings(draw.wind, draw.wind_from, draw.gusts, battery=1e6), seed, slope, ground)
    draw = _above(world.ground, draw)
    north, west, up = draw.start
    vehicle = craft.fly(seed, Start(north=north, west=west, up=up, heading=draw.course, airborne=True))
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, world), airborne=True)
    try:
        _fly_to_mark(aircraft, draw)
        return _land(aircraft, seed, draw)
    except DivergedError:
        return _nothing(aircraft, seed, draw)


def _fly_to_mark(aircraft: Aircraft, draw: _Draw) -> None:
    vehicle, (c, s) = aircraft.vehicle, (math.cos(draw.course), math.sin(draw.course))
    aircraft.advance(SETTLING_PERIODS)
    aircraft.autopilot.guided.go_to(draw.target)
    began = vehicle.time
    while vehicle.time - began < MAX_TIME_TO_MARK:
        p = vehicle.truth.body.position
        if p.x * c + p.y * s >= draw.mark:
            break
        aircraft.advance(LANDING_SAMPLE_PERIODS)


def _land(aircraft: Aircraft, seed: int, draw: _Draw) -> AskedLanding:
    vehicle = aircraft.vehicle
    here, law, began = vehicle.truth.body.position, vehicle.law, vehicle.time
    aircraft.autopilot.set_mode(Mode[draw.request])
    low, touched, motion, at_touch = math.inf, math.inf, vehicle.truth.body.velocity, here
    while vehicle.law.regime is not Regime.GROUND and vehicle.time - began < MAX_ASKED_TIME:
        motion = vehicle.truth.body.velocity if math.isinf(touched) else motion
        aircraft.advance(LANDING_SAMPLE_PERIODS)
        if vehicle.truth.body.position.z > at_touch.z + TOUCH_AND_GO:
            touched = math.inf
        if math.isinf(touched):
            if aircraft.view().forward:
                low = min(low, height_over(vehicle.surroundings.ground, vehicle.truth.body.position))
            if is_touching(vehicle.truth, vehicle.surroundings.ground, vehicle.airframe):
                touched, at_touch = vehicle.time, vehicle.truth.body.position
    down, in_air = vehicle.time, math.isinf(touched)
    aircraft.advance(STANDING_PERIODS)
    p = vehicle.truth.body.position
    wanted = (0.0, 0.0) if draw.request == "RTL" else here[:2]
    return AskedLanding(
        seed=seed,
        request=draw.request,
        place=(here.x, here.y, here.z),
        wind=draw.wind,
        law=law.name,
        end=_end(aircraft, down - began, in_air=in_air),
        low=low,
        unnoticed=0.0 if in_air else down - touched,
        slid=math.dist(p[:2], at_touch[:2]),
        sink=-motion.z,
        level=math.hypot(motion.x, motion.y),
        off=math.dist(p[:2], wanted),
        time=down - began,
        ground=p.z - height_over(vehicle.surroundings.ground, p),
    )


def _end(aircraft: Aircraft, time: float, *, in_air: bool) -> AskedLandingEnd:
    vehicle = aircraft.vehicle
    if in_air and vehicle.law is Law.LANDED:
        return AskedLandingEnd.IN_THE_AIR
    if vehicle.crash is not None:
        return AskedLandingEnd.CRASHED
    if time >= MAX_ASKED_TIME or vehicle.law is not Law.LANDED:
        return AskedLandingEnd.IN_THE_AIR if in_air and time < MAX_ASKED_TIME else AskedLandingEnd.LATE
    stands = x_axis(vehicle.truth.body.attitude).z > STANDING_COSINE
    return AskedLandingEnd.UPRIGHT if stands else AskedLandingEnd.TIPPED


def _nothing(aircraft: Aircraft, seed: int, draw: _Draw) -> AskedLanding:
    """A flight whose simulation left the finite numbers."""
    nan = math.nan
    law = aircraft.vehicle.law.name
    end = AskedLandingEnd.CRASHED
    return AskedLanding(seed, draw.request, draw.start, draw.wind, law, end, nan, nan, nan, nan, nan, nan, nan, nan)


def passed(results: Sequence[AskedLanding]) -> bool:
    """Whether every one ended well."""
    return all(result.is_good for result in results)


def summary(results: Sequence[AskedLanding]) -> list[str]:
    """Ends by wind, and each flight that did not end well, as lines of text."""
    lines = [f"{len(results)} returns and landings asked for on the way, seeds {results[0].seed} to {results[-1].seed}"]
    for wind in sorted({result.wind for result in results}):
        group = [result for result in results if result.wind == wind]
        ends = ", ".join(f"{sum(r.end is end for r in group)} {end}" for end in AskedLandingEnd)
        lines.append(f"{'calm' if wind == 0.0 else f'{wind:g} m/s'}: {ends}")
        lines.append(f"{'':<32}{'median':>9}{'p95':>9}{'max':>9}")
        for name, field in (
            ("unnoticed on the ground [s]", "unnoticed"),
            ("slid there [m]", "slid"),
            ("sink at the touch [m/s]", "sink"),
            ("level speed at the touch [m/s]", "level"),
            ("from where it should stand [m]", "off"),
            ("time [s]", "time"),
        ):
            values = [getattr(result, field) for result in group]
            lines.append(f"{name:<32}" + "".join(f"{np.nanquantile(values, share):9.2f}" for share in (0.5, 0.95, 1.0)))
    return lines + [
        f"{r.end}: seed {r.seed}: {r.request} in {r.law} at north {r.place[0]:.0f}, west {r.place[1]:.0f}, "
        f"up {r.place[2]:.0f} m, wind {r.wind:g} m/s: not upright down to {r.low:.1f} m, touched at {r.sink:.2f} m/s "
        f"down and {r.level:.2f} m/s level on ground {r.ground:+.1f} m from home's, noticed after {r.unnoticed:.2f} s"
        for r in results
        if not r.is_good
    ]
