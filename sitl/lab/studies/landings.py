"""Landings in wind and gusts: from a hover, asked for anywhere, and contacts felt where there are none."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.names import Mode
from sitl import (
    Aircraft,
    Configuration,
    DivergedError,
    Law,
    Reason,
    Regime,
    Settings,
    SitlError,
    Start,
    Vector,
    WorldSettings,
)
from sitl.autopilot.arming import MAX_STANDING_TILT
from sitl.control.reference import Point
from sitl.lab.studies.proportions import percent_bounds
from sitl.lab.studies.seeded_flights import (
    SAMPLE_PERIODS,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    seeds,
    write_json,
)
from sitl.lab.study_options import AIR, ASKED, DEFAULT_FLIGHTS, DEFAULT_GUSTS, DEFAULT_WINDS, HOVER, LANDING_HEIGHT
from sitl.model.ground import GroundPlane, height_over, is_touching
from sitl.model.quaternions import x_axis
from sitl.vehicle.aircraft import is_forward

# Landings of the whole vehicle in wind and gusts: how it ends, and how long it bounces.

MIN_LANDING_HEIGHT = 0.5  # where a landing may begin [m]
HOLD_BEFORE = 3000  # control periods before it: the wind is known then
STAND_AFTER = 1500  # control periods after it, in which it may still fall over
MAX_LANDING_TIME = 90.0  # [s]
MAX_BOUNCE = 3.0  # [s]
LANDINGS_PER_TASK = 4  # handed to a worker process at once


class LandingEnd(StrEnum):
    """End of a landing."""

    UPRIGHT = "upright"
    TIPPED = "tipped over"
    CRASHED = "crashed"
    IN_THE_AIR = "stopped in the air"
    LATE = "late"


class Landing(NamedTuple):
    """Result of one landing."""

    seed: int
    wind: float  # steady [m/s]
    heading: float  # of the belly, from where the wind comes [rad]
    end: LandingEnd
    bounce: float  # from the first touch to rest [s]
    sink: float  # at the first touch [m/s]
    slide: float  # level speed then [m/s]
    away: float  # from where the landing began [m]
    time: float  # [s]


def fly(
    seed: int,
    craft: Craft,
    wind: float,
    gusts: float,
    slope: float = 0.0,
    ground: float = 0.0,
    height: float = LANDING_HEIGHT,
) -> Landing:
    """Fly one landing.

    Args:
        seed: Of wind, heading, where the ground rises, gusts and sensors.
        craft: What is flown.
        wind: Greatest steady wind [m/s].
        gusts: Rms per axis [m/s].
        slope: Of the ground [deg].
        ground: Its height above home, at home [m].
        height: Above it, of the hover before [m].
    """
    random = np.random.default_rng(seed)
    speed, wind_from, heading = (
        float(random.uniform(*limits)) for limits in ((0.0, wind), (-180.0, 180.0), (-math.pi, math.pi))
    )
    start = Start(up=height + ground, heading=heading, airborne=True)
    vehicle = craft.fly(seed, start)
    world = on_drawn_ground(WorldSettings(speed, wind_from, gusts, battery=1e6), seed, slope, ground)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, world), airborne=True)
    aircraft.advance(HOLD_BEFORE)
    here, began = vehicle.truth.body.position, vehicle.time
    aircraft.autopilot.guided.land()
    touched, motion = math.inf, Vector(0.0, 0.0, 0.0)
    while vehicle.law.regime is not Regime.GROUND and vehicle.time - began < MAX_LANDING_TIME:
        before = vehicle.truth.body.velocity
        aircraft.advance(SAMPLE_PERIODS)
        touches = is_touching(vehicle.truth, vehicle.surroundings.ground, vehicle.airframe)
        if touches and math.isinf(touched):
            touched, motion = vehicle.time, before
    down = vehicle.time
    stopped = vehicle.law.regime is Regime.GROUND and math.isinf(touched)
    aircraft.advance(STAND_AFTER)
    return Landing(
        seed=seed,
        wind=speed,
        heading=math.remainder(heading + math.radians(wind_from), math.tau),
        end=LandingEnd.IN_THE_AIR if stopped else _end(aircraft),
        bounce=max(down - touched, 0.0),
        sink=-motion.z,
        slide=math.hypot(motion.x, motion.y),
        away=math.dist(vehicle.truth.body.position[:2], here[:2]),
        time=down - began,
    )


def _end(aircraft: Aircraft) -> LandingEnd:
    view = aircraft.view()
    if view.crash is not None:
        return LandingEnd.CRASHED
    if not view.landed:
        return LandingEnd.LATE
    return LandingEnd.TIPPED if view.tilt > MAX_STANDING_TILT else LandingEnd.UPRIGHT


def on_drawn_ground(world: WorldSettings, seed: int, slope: float, height: float) -> WorldSettings:
    """A world with its ground at a slope [deg] and a height at home [m]; where it rises is drawn by the seed."""
    rises_to = float(np.random.default_rng((seed, 33)).uniform(-180.0, 180.0))
    return world._replace(ground_height=height, ground_slope=slope, ground_rises_to=rises_to)


def run(
    flights: int,
    first: int,
    craft: Craft,
    wind: float,
    gusts: float,
    jobs: int = 1,
    *,
    slope: float = 0.0,
    ground: float = 0.0,
    height: float = LANDING_HEIGHT,
) -> list[Landing]:
    """Fly seeds ``first`` to ``first + flights - 1``; their order and results do not depend on the jobs.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    landing = partial(fly, craft=craft, wind=wind, gusts=gusts, slope=slope, ground=ground, height=height)
    return fly_draws(landing, seeds(flights, first), jobs, LANDINGS_PER_TASK)


def count(results: Sequence[Landing], end: LandingEnd) -> int:
    """Number of landings that ended so."""
    return sum(result.end is end for result in results)


def summary(results: Sequence[Landing], height: float = LANDING_HEIGHT) -> list[str]:
    """Ends of the landings, and each that did not end upright or bounced for long, as lines of text."""
    counts = {end: count(results, end) for end in LandingEnd}
    ends = ", ".join(f"{n} {end} ({percent_bounds(n, len(results))})" for end, n in counts.items())
    lines = [f"{len(results)} landings from {height:g} m, seeds {results[0].seed} to {results[-1].seed}: {ends}"]
    lines.append(f"{'':<32}{'median':>9}{'p95':>9}{'max':>9}")
    for name, field in (
        ("first touch to rest [s]", "bounce"),
        ("sink at the touch [m/s]", "sink"),
        ("level speed at the touch [m/s]", "slide"),
        ("from where it began [m]", "away"),
        ("time [s]", "time"),
    ):
        values = [getattr(result, field) for result in results]
        lines.append(f"{name:<32}" + "".join(f"{np.quantile(values, share):9.2f}" for share in (0.5, 0.95, 1.0)))
    return lines + [
        f"{r.end}: seed {r.seed}: wind {r.wind:.1f} m/s, belly {math.degrees(r.heading):.0f} deg from it, touched at "
        f"{r.sink:.2f} m/s down and {r.slide:.2f} m/s level, {r.bounce:.1f} s to rest"
        for r in results
        if r.end is not LandingEnd.UPRIGHT or r.bounce > MAX_BOUNCE
    ]


# Returns and landings that are asked for anywhere on the way past home: how they end, and what they do before it.


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


def fly_asked(
    seed: int, craft: Craft, wind: float, gusts: float, slope: float = 0.0, ground: float = 0.0
) -> AskedLanding:
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
            if is_forward(vehicle) and aircraft.view().forward:
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
        end=_asked_end(aircraft, down - began, in_air=in_air),
        low=low,
        unnoticed=0.0 if in_air else down - touched,
        slid=math.dist(p[:2], at_touch[:2]),
        sink=-motion.z,
        level=math.hypot(motion.x, motion.y),
        off=math.dist(p[:2], wanted),
        time=down - began,
        ground=p.z - height_over(vehicle.surroundings.ground, p),
    )


def _asked_end(aircraft: Aircraft, time: float, *, in_air: bool) -> AskedLandingEnd:
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


def asked_passed(results: Sequence[AskedLanding]) -> bool:
    """Whether every one ended well."""
    return all(result.is_good for result in results)


def asked_summary(results: Sequence[AskedLanding]) -> list[str]:
    """Ends by wind, and each flight that did not end well, as lines of text."""
    lines = [f"{len(results)} returns and landings asked for on the way, seeds {results[0].seed} to {results[-1].seed}"]
    for wind in sorted({result.wind for result in results}):
        group = [result for result in results if result.wind == wind]
        counts = {end: sum(r.end is end for r in group) for end in AskedLandingEnd}
        ends = ", ".join(f"{n} {end} ({percent_bounds(n, len(group))})" for end, n in counts.items())
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


# Holds, legs and descents broken off, for hours in wind and gusts: whether the air is ever taken for the ground.


LONG_FLIGHT_TIME = 600.0  # one flight, unless it ends before [s]
ORDER_TIME = 30.0  # between two orders [s]
DESCENT_TIME = 8.0  # a descent is broken off after so long [s]
LOWEST_SENT, HIGHEST_SENT = 25.0, 80.0  # where it is sent [m]
FARTHEST = 150.0  # from home, in north and in west [m]
AIR_SAMPLE_TIME, AIR_SAMPLE_PERIODS = 1.0, 500


class LongFlight(NamedTuple):
    """Result of one long flight."""

    seed: int
    wind: float  # [m/s]
    gusts: float  # rms per axis [m/s]
    flown: float  # [s]
    lowest: float  # [m]
    false_contact: str  # where a touch-down was seen in the air; empty if none was
    crashed: bool  # hit the ground without one


def fly_in_air(seed: int, craft: Craft, wind: float, gusts: float) -> LongFlight:
    """Fly one: every half minute it holds, goes elsewhere, or begins a landing that is broken off.

    Args:
        seed: Of orders, wind, gusts and sensors.
        craft: What is flown.
        wind: Greatest steady wind [m/s].
        gusts: Greatest gusts, rms per axis [m/s].
    """
    random = np.random.default_rng((seed, 32))
    speed, wind_from, rms = float(random.uniform(0.0, wind)), float(random.uniform(-180.0, 180.0)), gusts
    rms *= float(random.uniform(0.0, 1.0))
    vehicle = craft.fly(seed, Start(up=0.5 * (LOWEST_SENT + HIGHEST_SENT), airborne=True))
    air = WorldSettings(speed, wind_from, rms, battery=1e9)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)
    lowest, since, descends = math.inf, 0.0, False
    try:
        while vehicle.time < LONG_FLIGHT_TIME and vehicle.law is not Law.LANDED and vehicle.crash is None:
            if descends and since >= DESCENT_TIME:
                aircraft.autopilot.guided.hold()
                descends = False
            if since >= ORDER_TIME:
                since, descends = 0.0, _order(aircraft, random)
            aircraft.advance(AIR_SAMPLE_PERIODS)
            since += AIR_SAMPLE_TIME
            lowest = min(lowest, vehicle.truth.body.position.z)
    except DivergedError:
        return LongFlight(seed, speed, rms, vehicle.time, lowest, "", crashed=True)
    return LongFlight(seed, speed, rms, vehicle.time, lowest, _false_contact(aircraft), vehicle.crash is not None)


def _order(aircraft: Aircraft, random: np.random.Generator) -> bool:
    """Give the next order; tells whether it is a descent."""
    guided, kind = aircraft.autopilot.guided, float(random.uniform())
    north, west = (float(x) for x in random.uniform(-FARTHEST, FARTHEST, 2))
    height = float(random.uniform(LOWEST_SENT, HIGHEST_SENT))
    if kind < 0.25 and aircraft.view().p[2] > LOWEST_SENT:
        guided.land()
        return True
    if kind < 0.5:
        guided.hold()
    else:
        guided.go_to((north, west, height))
    return False


def _false_contact(aircraft: Aircraft) -> str:
    """Law, time and height of the first touch-down seen in the air; empty if none was."""
    vehicle = aircraft.vehicle
    for jump in vehicle.jumps:
        if jump.reason is Reason.TOUCHDOWN:
            return f"{jump.source.name} after {jump.time:.0f} s, {vehicle.truth.body.position.z:.0f} m up"
    return ""


def air_passed(results: Sequence[LongFlight]) -> bool:
    """Whether the air was never taken for the ground."""
    return not any(result.false_contact for result in results)


def air_summary(results: Sequence[LongFlight]) -> list[str]:
    """Hours flown and false touch-downs by wind, and each flight that ended before its time, as lines of text."""
    hours = sum(result.flown for result in results) / 3600.0
    false = sum(bool(result.false_contact) for result in results)
    lines = [
        f"{len(results)} flights, seeds {results[0].seed} to {results[-1].seed}: "
        f"{hours:.1f} h in the air, {false} false touch-downs"
    ]
    for least in range(0, 12, 4):
        group = [r for r in results if least <= r.wind < least + 4 or (least == 8 and r.wind >= 12)]
        if group:
            ends = sum(bool(r.false_contact) for r in group), sum(r.crashed for r in group)
            lines.append(
                f"wind from {least} m/s on: {sum(r.flown for r in group) / 3600.0:.1f} h, {ends[0]} false touch-downs, "
                f"{ends[1]} crashed"
            )
    return lines + [
        f"seed {r.seed}: wind {r.wind:.1f} m/s, gusts {r.gusts:.1f} m/s: "
        + (f"touch-down in {r.false_contact}" if r.false_contact else f"crashed after {r.flown:.0f} s")
        for r in results
        if r.false_contact or r.crashed
    ]


MIN_UPRIGHT = 0.98  # share of the landings
MAX_SLOPE, MAX_GROUND = 30.0, 500.0  # [deg], [m]


def study_landings(args: argparse.Namespace) -> int:
    """Fly and print figures; exit code 1 if a flight ends as none of its kind may."""
    for name, defaults in (("flights", DEFAULT_FLIGHTS), ("wind", DEFAULT_WINDS), ("gusts", DEFAULT_GUSTS)):
        if getattr(args, name) is None:
            setattr(args, name, defaults[args.kind])
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "slope": MAX_SLOPE})
    _check_ground(args)

    craft, progress = craft_of(args), partial(print_progress, of=args.flights)
    ground = {"slope": args.slope, "ground": args.ground}
    air = {"craft": craft, "wind": args.wind, "gusts": args.gusts}
    drawn = seeds(args.flights, args.first)
    if args.kind == ASKED:
        flight = partial(fly_asked, **air, **ground)
        asked = fly_draws(flight, drawn, args.jobs, ASKED_PER_TASK, progress)
        lines, good = asked_summary(asked), asked_passed(asked)
        written = [{**result._asdict(), "good": result.is_good} for result in asked]
    elif args.kind == AIR:
        flown = fly_draws(partial(fly_in_air, **air), drawn, args.jobs, on_progress=progress)
        lines, good = air_summary(flown), air_passed(flown)
        written = [result._asdict() for result in flown]
    else:
        results = run(args.flights, args.first, craft, args.wind, args.gusts, args.jobs, **ground, height=args.height)
        lines, good = summary(results, args.height), passed(results)
        written = [landing._asdict() for landing in results]
    print("\n".join(lines), flush=True)
    if args.json is not None:
        write_json(args.json, written)
    return 0 if good else 1


def _check_ground(args: argparse.Namespace) -> None:
    """Refuse ground that no flight of the kind has."""
    if args.kind == AIR and (args.slope or args.ground):
        raise SitlError(f"--slope and --ground: flights of --kind {AIR} do not come to the ground")
    if args.kind != HOVER and args.height != LANDING_HEIGHT:
        raise SitlError(f"--height: only landings of --kind {HOVER} begin at a height of one's choice")
    if not MIN_LANDING_HEIGHT <= args.height <= MAX_GROUND:
        raise SitlError(f"--height {args.height:g} is not within {MIN_LANDING_HEIGHT:g} and {MAX_GROUND:g} m")
    if abs(args.ground) > MAX_GROUND:
        raise SitlError(f"--ground {args.ground:g} is not within -{MAX_GROUND:g} and {MAX_GROUND:g} m")


def passed(results: Sequence[Landing]) -> bool:
    """Whether enough landings end upright, none in the air, and none bounces for long."""
    steady = all(result.bounce <= MAX_BOUNCE for result in results)
    stopped = count(results, LandingEnd.IN_THE_AIR)
    return steady and not stopped and count(results, LandingEnd.UPRIGHT) >= MIN_UPRIGHT * len(results)
