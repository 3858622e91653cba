"""From the reference to an acceleration, by one law at any speed: a velocity towards a point ahead, and its error.

The point is the position to hover at, or where the line of sight meets the path. How fast it is approached follows from
how far braking takes, so that cruise, stop and hover are one formula, with no mode in it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Estimate
from sitl.control.forward_flight.forward_guidance import FAST, ground_speed
from sitl.control.reference import CIRCLE, LEG, MIN_AHEAD, TIME_AHEAD, Reference, height_to, line_of_sight, progress
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped, sine_cosine
from sitl.model.vectors import Vector, level_norm, norm, subtract

FAR = 1e6  # from the end of a path that has none [m]
FASTEST_HOVER = 6.0  # faster than this it flies: no limit of the hover is greater [m/s]
STANDING_TURN = 4.0  # slower than this, the belly has to face the way before it is flown fast [m/s]
SIDEWAYS = 1.5  # speed of a way that the belly does not face [m/s]
FACES_NOT, FACES = 0.5, 0.9  # cosines between belly and way
FOLLOWS = 0.7  # of the speed wanted, above which the braking is fed forward, at all of it fully [-]
ONSET, ONSET_SHARE = 0.6, 0.5  # of a hover's braking: over so much speed, or this share of its limit [m/s], [-]
MAX_BRAKING_FACTOR = 1.4  # of the planned deceleration, asked for at most [-]
BRAKES = 4.0  # times this share of the planned deceleration, all of the climb is flown [-]
BEHIND = 0.5  # cosine between way and wind from which on it comes from behind [-]
NO_COURSE = 0.5  # slower than this, the way to the point ahead is the course [m/s]


class IndiGuidanceGains(NamedTuple):
    """Gains and limits from the reference to the acceleration."""

    k_p: float  # distance to speed, near the end [1/s]
    k_v: float  # velocity error to acceleration [1/s]
    k_z: float  # altitude error to vertical speed [1/s]
    k_vz: float  # vertical speed error to acceleration [1/s]
    brake: float  # deceleration planned [m/s2]
    brake_fast: float  # the same above 12 m/s, where idling motors give no more [m/s2]
    max_forward: float  # acceleration along the course [m/s2]
    min_turn: float  # across it, when slow [m/s2]
    max_turn: float  # and from 12 m/s of airspeed on [m/s2]
    max_rise: float  # vertical speeds [m/s]
    max_sink: float
    max_up: float  # vertical accelerations [m/s2]
    max_down: float
    max_jerk: float  # [m/s3]
    low: float  # share of what a path leads below its end, that is flown [-]
    climb: float  # vertical speed that takes load off elevons that have no travel left [m/s]
    climb_from: float  # share of their travel in use from which it climbs [-]
    climb_full: float  # and where all of it is flown [-]
    max_climb: float  # higher than this above the altitude wanted, it does not [m]
    edge_on_wind: float  # in which a stop is made with the span into the wind [m/s]
    edge_on_below: float  # airspeed from which on it is turned there, in a wind from ahead or aside [m/s]
    edge_on_slow: float  # the same in one from behind [m/s]


class FlownAim(NamedTuple):
    """Direction, speed, altitude and curvature that guidance aims at."""

    north: float  # level unit vector
    west: float
    speed: float  # over the ground [m/s]
    brake: float  # deceleration fed forward [m/s2]
    altitude: float  # [m]
    slope: float  # of the altitude along the way
    curvature: float  # of the way, positive to the left [1/m]


@kernel
def stopping_speed(distance: float, gains: IndiGuidanceGains) -> float:
    """Speed from which the planned deceleration stops within a distance, and k_p times it near the end [m/s]."""
    near = gains.brake / (gains.k_p * gains.k_p)
    far = math.sqrt(2.0 * gains.brake * max(distance - 0.5 * near, 0.0))
    fast = 0.5 * (near + FAST * FAST / gains.brake)  # from where it is FAST
    farther = math.sqrt(FAST * FAST + 2.0 * gains.brake_fast * max(distance - fast, 0.0))
    return gains.k_p * distance if distance <= near else min(far, farther)


@kernel
def stopping_distance(speed: float, gains: IndiGuidanceGains) -> float:
    """Distance from which the planned deceleration stops from a speed over the ground [m]."""
    near = 0.5 * gains.brake / (gains.k_p * gains.k_p)
    slow, fast = min(speed, FAST), max(speed, FAST)
    far = near + 0.5 * slow * slow / gains.brake + 0.5 * (fast * fast - FAST * FAST) / gains.brake_fast
    return speed / gains.k_p if gains.k_p * speed <= gains.brake else far


@kernel
def aim(p: Vector, v: Vector, wind: Vector, reference: Reference, course: float, gains: IndiGuidanceGains) -> FlownAim:
    """Aim of the reference from a position at a velocity; ``course`` is the azimuth of the belly [rad]."""
    path, speed = reference.path, level_norm(v.x, v.y)
    x, y = reference.position.x - p.x, reference.position.y - p.y
    distance = level_norm(x, y)
    ux, uy = x / max(distance, 1e-6), y / max(distance, 1e-6)
    if not reference.forward:
        stop, closing = stopping_speed(distance, gains), v.x * ux + v.y * uy
        flies = closing > max(FASTEST_HOVER, reference.speed)  # what is left of a flight is braked, not thrown away
        wanted = min(stop, closing if flies else reference.speed)
        # At once, the elevons' first push, which turns the nose back, would add a tenth to the speed.
        onset = min(ONSET, ONSET_SHARE * reference.speed)
        begun = 1.0 if flies else clipped((reference.speed - stop) / onset, 0.0, 1.0)
        fed = begun * _fed(wanted, stop, closing, gains)
        return FlownAim(
            north=ux, west=uy, speed=wanted, brake=fed, altitude=reference.position.z, slope=0.0, curvature=0.0
        )
    north, west = line_of_sight(path, p, speed)
    along, length, _ = progress(path, p)
    stops = path.kind == LEG and path.stop
    ends = stops and length - along < max(TIME_AHEAD * speed, MIN_AHEAD)
    ux, uy = (ux, uy) if ends else (north, west)
    z, slope = height_to(path, p, gains.low * path.low)
    stop, closing = stopping_speed(distance if stops else FAR, gains), v.x * ux + v.y * uy
    sine, cosine = sine_cosine(course)
    faces = clipped((cosine * ux + sine * uy - FACES_NOT) / (FACES - FACES_NOT), 0.0, 1.0)
    cruise = ground_speed(north, west, wind, path.airspeed)
    cruise = cruise if speed >= STANDING_TURN else SIDEWAYS + (cruise - SIDEWAYS) * faces
    wanted = min(cruise, stop)
    curvature = 1.0 / path.radius if path.kind == CIRCLE else 0.0
    return FlownAim(
        north=ux,
        west=uy,
        speed=wanted,
        brake=_fed(wanted, stop, closing, gains),
        altitude=reference.position.z if ends else z,
        slope=0.0 if ends else slope,
        curvature=curvature,
    )


@kernel
def _fed(wanted: float, stop: float, closing: float, gains: IndiGuidanceGains) -> float:
    """The deceleration to feed forward, once the way to the end is what limits the speed [m/s2]."""
    # By degrees: a point that moves away slowly is followed at a share of that speed, where a step would make it swing.
    share = clipped((closing - FOLLOWS * wanted) / ((1.0 - FOLLOWS) * max(wanted, 1e-6)), 0.0, 1.0)
    planned = gains.brake if stop < FAST else gains.brake_fast
    return share * min(planned, gains.k_p * max(closing, 0.0)) if wanted >= stop else 0.0


@kernel
def turns_edge_on(estimate: Estimate, reference: Reference, gains: IndiGuidanceGains) -> bool:
    """Whether a stop in a strong wind has come so far that the vehicle turns its span into the wind.

    Facing the wind at less than the stall's airspeed, elevons have no travel left to turn it any more.
    """
    path, p, wind, v = reference.path, estimate.position, estimate.wind, estimate.velocity
    if not reference.forward or path.kind != LEG or not path.stop or level_norm(wind.x, wind.y) < gains.edge_on_wind:
        return False
    x, y = path.end.x - p.x, path.end.y - p.y
    distance = level_norm(x, y)
    ux, uy = x / max(distance, 1e-6), y / max(distance, 1e-6)
    if stopping_speed(distance, gains) > ground_speed(ux, uy, wind, path.airspeed):
        return False
    airspeed = level_norm(v.x - wind.x, v.y - wind.y)
    behind = wind.x * ux + wind.y * uy > BEHIND * level_norm(wind.x, wind.y)
    return airspeed < (gains.edge_on_slow if behind else gains.edge_on_below)


@subroutine
def wanted_acceleration(
    estimate: Estimate, v: Vector, reference: Reference, course: float, gains: IndiGuidanceGains, a: Airframe
) -> Vector:
    """The acceleration wanted, world [m/s2].

    Args:
        estimate: Of position, wind and elevons.
        v: The velocity to be governed, world [m/s].
        reference: Where to.
        course: Azimuth of the belly without airspeed [rad].
        gains: Gains and limits.
        a: The airframe as the law knows it.
    """
    p, wind = estimate.position, estimate.wind
    to, speed = aim(p, v, wind, reference, course, gains), level_norm(v.x, v.y)
    x = gains.k_v * (to.speed * to.north - v.x) - to.brake * to.north
    y = gains.k_v * (to.speed * to.west - v.y) - to.brake * to.west
    ux, uy = (v.x / speed, v.y / speed) if speed > NO_COURSE else (to.north, to.west)
    share = min(norm(subtract(v, wind)) / FAST, 1.0)
    most = max(gains.min_turn, gains.max_turn * share * share)
    along = clipped(x * ux + y * uy, -MAX_BRAKING_FACTOR * gains.brake, gains.max_forward)
    turn = clipped(y * ux - x * uy + to.curvature * speed * speed, -most, most)
    rise = clipped(to.slope * speed + gains.k_z * (to.altitude - p.z), -gains.max_sink, gains.max_rise)
    rise = _relieved(rise, p.z - to.altitude, -along / gains.brake, estimate, gains, a)
    vertical = clipped(gains.k_vz * (rise - v.z), -gains.max_down, gains.max_up)
    return Vector(along * ux - turn * uy, along * uy + turn * ux, vertical)


@kernel
def _relieved(
    rise: float, above: float, braking: float, estimate: Estimate, gains: IndiGuidanceGains, a: Airframe
) -> float:
    """A vertical speed [m/s], raised where braking uses up the elevons: climbing lowers the incidence.

    Args:
        rise: Wanted otherwise [m/s].
        above: The altitude wanted [m].
        braking: Deceleration, as a share of the planned one.
        estimate: Of the elevons.
        gains: How fast it climbs, and where.
        a: The airframe as the law knows it.
    """
    used = 0.5 * abs(estimate.actuators.left_elevon + estimate.actuators.right_elevon) / a.delta_max
    need = clipped((used - gains.climb_from) / (gains.climb_full - gains.climb_from), 0.0, 1.0)
    need *= clipped(BRAKES * braking, 0.0, 1.0)
    climb = gains.climb * need * clipped(0.5 * (gains.max_climb - above), 0.0, 1.0)
    return rise + need * max(climb - rise, 0.0)
