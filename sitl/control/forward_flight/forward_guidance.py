"""Acceleration set-point of the line of sight in cruise, and the moment at which braking replaces it.

The braking itself is :mod:`sitl.control.braking`; its tables are needed here as well.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Estimate
from sitl.control.reference import CIRCLE, LEG, Path, Reference, height, line_of_sight, progress
from sitl.model.airframe import Array
from sitl.model.arithmetic import arctangent, clipped
from sitl.model.vectors import Vector, level_norm, norm, subtract

SLOW = 4.0  # below this the course is no direction to steer by [m/s]
FAST = 12.0  # airspeed from which the wing gives the greatest turning acceleration [m/s]
STEPS = 24  # of the integral that makes the braking profile
CELLS_PER_SPEED = 2.0  # of the braking tables: a cell is 0.5 m/s wide [s/m]


class GuidanceGains(NamedTuple):
    """Gains and limits of the guidance."""

    k_v: float  # speed error to acceleration [1/s]
    k_i: float  # velocity error to the integral's rate [1/s2]
    max_integral: float  # [m/s2]
    max_forward: float  # acceleration along the path [m/s2]
    min_turn: float  # limit of the turning acceleration when slow [m/s2]
    max_turn: float  # and from 12 m/s on; between them it grows with the airspeed squared [m/s2]
    k_z: float  # altitude error to vertical speed [1/s]
    k_vz: float  # vertical speed error to acceleration [1/s]
    max_rise: float  # vertical speeds [m/s]
    max_sink: float
    max_up: float  # vertical accelerations [m/s2]
    max_down: float
    max_jerk: float  # [m/s3]
    brake_rate: Array  # deceleration planned at the airspeeds 0, 0.5, 1 ... m/s, (n,) [m/s2]
    brake_climb: Array  # climb rate held there while braking, (n,) [m/s]
    min_brake_rate: float  # smallest of those decelerations [m/s2]
    climb_share: float  # of that climb when the elevons have plenty left; all of it when they have not
    climb_from: float  # share of the elevons' travel in use from which the climb grows
    climb_full: float  # and where it is whole
    creep: float  # speed towards the end once the braking is over [m/s]
    max_climb: float  # braking climbs no higher above its end than this [m]
    near: float  # close to the end the speed falls by this much per metre [1/s]


class MotionInAir(NamedTuple):
    """Place and velocity of the vehicle, and the wind it flies in, world."""

    position: Vector  # [m]
    velocity: Vector  # over the ground [m/s]
    wind: Vector  # velocity of the air as it is known [m/s]


class Guided(NamedTuple):
    """Set-point of the guidance, and what it keeps."""

    acceleration: Vector  # world [m/s2]
    integral: Vector  # of the velocity error along the course, to its left and upwards [m/s2]


@kernel
def at_airspeed(airspeed: float, table: Array) -> float:
    """Linear interpolation of a braking table, held at its end."""
    place = min(max(0.0, CELLS_PER_SPEED * airspeed), table.size - 1.0)  # of a NaN, 0
    i = min(int(place), table.size - 2)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


@kernel
def ground_speed(north: float, west: float, wind: Vector, airspeed: float) -> float:
    """Speed over the ground along a level unit direction with an airspeed in a wind; never below 1 [m/s]."""
    along = wind.x * north + wind.y * west
    across_2 = wind.x * wind.x + wind.y * wind.y - along * along
    return max(along + math.sqrt(max(airspeed * airspeed - across_2, 0.0)), 1.0)


@kernel
def air_course(estimate: Estimate, reference: Reference, course: float) -> float:
    """Azimuth of the air velocity that flies along the path: where belly or nose are to point [rad].

    Args:
        estimate: Of position, velocity and wind.
        reference: With the path.
        course: What it was, and stays where the line of sight has no direction [rad].
    """
    v, wind, path = estimate.velocity, estimate.wind, reference.path
    north, west = line_of_sight(path, estimate.position, level_norm(v.x, v.y))
    speed = ground_speed(north, west, wind, path.airspeed)
    azimuth = arctangent(speed * west - wind.y, speed * north - wind.x)
    return course if north == 0.0 and west == 0.0 else azimuth


@kernel
def cruise(flown: MotionInAir, path: Path, integral: Vector, dt: float, gains: GuidanceGains) -> Guided:
    """Acceleration that turns the velocity onto the line of sight at the wanted airspeed, and the next integral.

    Args:
        flown: The vehicle's motion.
        path: What is followed.
        integral: Of the velocity error along the course, to its left and upwards [m/s2].
        dt: Tick [s].
        gains: Gains and limits.
    """
    p, v, wind = flown.position, flown.velocity, flown.wind
    speed = level_norm(v.x, v.y)
    north, west = line_of_sight(path, p, speed)
    wanted = ground_speed(north, west, wind, path.airspeed)
    z, slope = height(path, p)
    rise = clipped(slope * speed + gains.k_z * (z - p.z), -gains.max_sink, gains.max_rise)
    vertical = gains.k_vz * (rise - v.z)
    if speed < SLOW:
        x, y = gains.k_v * (wanted * north - v.x), gains.k_v * (wanted * west - v.y)
        share = min(1.0, gains.max_forward / max(level_norm(x, y), 1e-6))
        return Guided(Vector(share * x, share * y, vertical), integral)
    ux, uy = v.x / speed, v.y / speed
    ahead, left = ux * north + uy * west, ux * west - uy * north  # of the line of sight, seen from the course
    angle = arctangent(left, ahead)
    along, turn = _pull(speed, norm(subtract(v, wind)), wanted, angle, path, gains)
    error = Vector(wanted * ahead - speed, wanted * left, rise - v.z)
    after = _integrated(integral, error, abs(angle), dt, gains)
    along, turn, vertical = along + after.x, turn + after.y, vertical + after.z
    return Guided(Vector(along * ux - turn * uy, along * uy + turn * ux, vertical), after)


@kernel
def _pull(
    speed: float, airspeed: float, wanted: float, angle: float, path: Path, gains: GuidanceGains
) -> tuple[float, float]:
    """Acceleration along the course and to its left without the integral [m/s2].

    Args:
        speed: Over the ground [m/s].
        airspeed: [m/s].
        wanted: Speed over the ground that is wanted [m/s].
        angle: Of the line of sight, left of the course [rad].
        path: What is followed.
        gains: Gains and limits.
    """
    slowest = -1.4 * at_airspeed(airspeed, gains.brake_rate)
    along = clipped(gains.k_v * (wanted - speed), slowest, gains.max_forward)
    share = airspeed / FAST
    max_turn = min(gains.max_turn, max(gains.min_turn, gains.max_turn * (share * share)))
    turn = 1.25 * gains.k_v * speed * angle + (speed * speed / path.radius if path.kind == CIRCLE else 0.0)
    return along, clipped(turn, -max_turn, max_turn)


@kernel
def _integrated(integral: Vector, error: Vector, angle: float, dt: float, gains: GuidanceGains) -> Vector:
    """The integral of the velocity error: forgotten in a turn, held while the error is large."""
    if angle > 0.5:
        return Vector(0.0, 0.0, 0.0)
    if norm(error) >= 4.0:
        return integral
    k = dt * gains.k_i
    x, y, z = integral.x + k * error.x, integral.y + k * error.y, integral.z + k * error.z
    share = min(1.0, gains.max_integral / max(math.sqrt(x * x + y * y + z * z), 1e-9))
    return Vector(share * x, share * y, share * z)


@subroutine
def stopping_distance(speed: float, along: float, across: float, gains: GuidanceGains) -> float:
    """Stopping distance of the braking profile [m].

    Args:
        speed: Over the ground [m/s].
        along: Wind along the way [m/s].
        across: Wind across it [m/s].
        gains: Gains with the braking table.
    """
    total, step = 0.0, speed / STEPS
    if step < 1e-6:
        return 0.0
    for i in range(STEPS):
        v = (i + 0.5) * step
        total += max(v * step / at_airspeed(level_norm(v - along, across), gains.brake_rate), step / gains.near)
    return total


@kernel
def due_to_stop(estimate: Estimate, path: Path, room: float, gains: GuidanceGains) -> bool:
    """Whether a leg that stops has no more left than ``room`` times what braking takes, or is overflown."""
    return stop_within(MotionInAir(estimate.position, estimate.velocity, estimate.wind), path, room, gains)


@kernel
def stop_within(flown: MotionInAir, path: Path, room: float, gains: GuidanceGains) -> bool:
    """The same, of a motion."""
    p, v, wind = flown.position, flown.velocity, flown.wind
    if path.kind != LEG or not path.stop:
        return False
    along, length, _ = progress(path, p)
    x, y = path.end.x - p.x, path.end.y - p.y
    distance = level_norm(x, y)
    if along >= length or distance < 1e-3:
        return True
    ux, uy = x / distance, y / distance
    closing = max(v.x * ux + v.y * uy, 0.0)
    # No braking is gentler than the smallest rate and the last metres together: far away nothing is integrated.
    if room * closing * (0.5 * closing / gains.min_brake_rate + 1.0 / gains.near) < distance:
        return False
    tail, cross = wind.x * ux + wind.y * uy, wind.x * uy - wind.y * ux
    return room * stopping_distance(closing, tail, cross, gains) >= distance
