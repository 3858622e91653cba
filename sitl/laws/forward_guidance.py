"""What acceleration the line of sight asks for: cruise on a path, and the braking that ends it.

The elevons rule everything here. Level flight between 4.5 and 7 m/s takes nearly all of their travel, and braking
there takes more: a level deceleration of 1 m/s2 already saturates them, the nose cannot rise, and the vehicle slides on
for fifty metres or dives. But *climbing* through that corridor lowers the incidence: at 2.5 m/s upwards even
2.5 m/s2 leaves a quarter of the travel. So braking climbs a few metres, and stops sooner for it.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Array
from sitl.laws.path import CIRCLE, LEG, Path, aim, height, progress

SLOW = 4.0  # below this the course is no direction to steer by [m/s]
STEPS = 24  # of the integral that makes the braking profile


class GuidanceGains(NamedTuple):
    """Gains and limits of the guidance."""

    k_v: float  # speed to acceleration [1/s]
    k_i: float  # integral of the velocity error [1/s2]
    integral_limit: float  # [m/s2]
    gain: float  # greatest acceleration along the path [m/s2]
    lateral: float  # least and, at 12 m/s squared-law, greatest turning acceleration [m/s2]
    lateral_most: float
    k_z: float  # altitude error to vertical speed [1/s]
    k_vz: float  # vertical speed to acceleration [1/s]
    rise_most: float  # vertical speeds asked for at most [m/s]
    sink_most: float
    up: float  # greatest vertical accelerations [m/s2]
    down: float
    jerk: float  # [m/s3]
    brake_air: Array  # airspeeds of the braking tables, (n,) [m/s]
    brake_rate: Array  # deceleration planned there, (n,) [m/s2]
    brake_climb: Array  # climb rate held there while braking, (n,) [m/s]
    climb_share: float  # of that climb when the elevons have plenty left; all of it when they have not
    climb_from: float  # share of the elevons' travel in use from which the climb grows, and where it is whole
    climb_whole: float
    creep: float  # speed towards the end once the braking is over [m/s]
    climb_cap: float  # braking climbs no higher above its end than this [m]
    near: float  # close to the end the speed falls by this much per metre [1/s]


@njit(cache=True)
def table(x: float, xs: Array, ys: Array) -> float:
    """Linear interpolation, held at both ends."""
    if x <= xs[0]:
        return float(ys[0])
    for i in range(1, len(xs)):
        if x <= xs[i]:
            share = (x - xs[i - 1]) / (xs[i] - xs[i - 1])
            return float(ys[i - 1] + share * (ys[i] - ys[i - 1]))
    return float(ys[-1])


@njit(cache=True)
def ground_speed(north: float, west: float, wind: Array, airspeed: float) -> float:
    """Speed over the ground along a level unit direction with an airspeed in a wind; never below 1 [m/s]."""
    along = wind[0] * north + wind[1] * west
    across_2 = wind[0] ** 2 + wind[1] ** 2 - along**2
    return float(max(along + math.sqrt(max(airspeed**2 - across_2, 0.0)), 1.0))


@njit(cache=True)
def stopping_distance(speed: float, along: float, across: float, gains: GuidanceGains) -> float:
    """How far the braking profile takes to stop [m].

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
        rate = min(table(math.hypot(v - along, across), gains.brake_air, gains.brake_rate), gains.near * v)
        total += v * step / rate
    return total


@njit(cache=True)
def braking_speed(distance: float, most: float, along: float, across: float, gains: GuidanceGains) -> float:
    """Speed over the ground from which the profile stops within a distance, at most ``most`` [m/s]."""
    total, step, v = 0.0, most / (2 * STEPS), 0.0
    for _ in range(2 * STEPS):
        middle = v + 0.5 * step
        rate = min(table(math.hypot(middle - along, across), gains.brake_air, gains.brake_rate), gains.near * middle)
        total += middle * step / rate
        if total > distance:
            return min(v + step * max(0.0, 1.0 - (total - distance) * rate / (middle * step)), distance * gains.near)
        v += step
    return most


@njit(cache=True)
def cruise(p: Array, v: Array, wind: Array, path: Path, integral: Array, dt: float, gains: GuidanceGains) -> Array:
    """Acceleration that turns the velocity onto the line of sight at the wanted airspeed, world, (3,) [m/s2].

    Args:
        p: Position, world, (3,) [m].
        v: Velocity, world, (3,) [m/s].
        wind: Velocity of the air as it is known, world, (3,) [m/s].
        path: What is followed.
        integral: Of the velocity error along the course, to its left and upwards, changed in place, (3,) [m/s2].
        dt: Tick [s].
        gains: Gains and limits.
    """
    speed = math.hypot(v[0], v[1])
    sx, sy = aim(path, p, speed)
    wanted = ground_speed(sx, sy, wind, path.airspeed)
    airspeed = math.sqrt((v[0] - wind[0]) ** 2 + (v[1] - wind[1]) ** 2 + (v[2] - wind[2]) ** 2)
    z, slope = height(path, p)
    rise = min(max(slope * speed + gains.k_z * (z - p[2]), -gains.sink_most), gains.rise_most)
    vertical = gains.k_vz * (rise - v[2])
    if speed < SLOW:
        ax, ay = gains.k_v * (wanted * sx - v[0]), gains.k_v * (wanted * sy - v[1])
        share = min(1.0, gains.gain / max(math.hypot(ax, ay), 1e-6))
        return np.array((share * ax, share * ay, vertical))
    ux, uy = v[0] / speed, v[1] / speed
    angle = math.atan2(ux * sy - uy * sx, ux * sx + uy * sy)  # from the course to the line of sight, to the left
    slowest = -1.4 * table(airspeed, gains.brake_air, gains.brake_rate)
    along = min(max(gains.k_v * (wanted - speed), slowest), gains.gain)
    most = min(gains.lateral_most, max(gains.lateral, gains.lateral_most * (airspeed / 12.0) ** 2))
    turn = 1.25 * gains.k_v * speed * angle
    if path.kind == CIRCLE:
        turn += speed**2 / path.radius
    turn = min(max(turn, -most), most)
    error = np.array((wanted * (ux * sx + uy * sy) - speed, wanted * (ux * sy - uy * sx), rise - v[2]))
    _integrate(error, abs(angle), integral, dt, gains)
    along, turn, vertical = along + integral[0], turn + integral[1], vertical + integral[2]
    return np.array((along * ux - turn * uy, along * uy + turn * ux, vertical))


@njit(cache=True)
def _integrate(error: Array, angle: float, integral: Array, dt: float, gains: GuidanceGains) -> None:
    size = math.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    if angle > 0.5:
        integral[:] = 0.0
    elif size < 4.0:
        for axis in range(3):
            integral[axis] += dt * gains.k_i * error[axis]
        n = math.sqrt(integral[0] ** 2 + integral[1] ** 2 + integral[2] ** 2)
        integral *= min(1.0, gains.integral_limit / max(n, 1e-9))


@njit(cache=True)
def arrest(v: Array, wind: Array, travel: float, gains: GuidanceGains) -> Array:
    """Acceleration that ends a fall and all motion with it, world, (3,) [m/s2]; it climbs if the elevons need it."""
    speed = math.hypot(v[0], v[1])
    airspeed = math.sqrt((v[0] - wind[0]) ** 2 + (v[1] - wind[1]) ** 2 + (v[2] - wind[2]) ** 2)
    level = min(1.0, table(airspeed, gains.brake_air, gains.brake_rate) / max(speed, 1e-6))
    rise = 0.5 + _need(travel, gains) * table(airspeed, gains.brake_air, gains.brake_climb)
    vertical = min(max(2.0 * (rise - v[2]), -2.0), gains.up)
    return np.array((-level * v[0], -level * v[1], vertical))


@njit(cache=True)
def brake(
    p: Array, v: Array, wind: Array, path: Path, travel: float, integral: Array, dt: float, gains: GuidanceGains
) -> Array:
    """Acceleration of the climbing stop at the end of a leg, world, (3,) [m/s2].

    Arguments as for :func:`cruise`, and ``travel``: the share of the elevons' that pitch uses now.
    """
    ex, ey = path.end[0] - p[0], path.end[1] - p[1]
    distance = math.hypot(ex, ey)
    ux, uy = (ex / distance, ey / distance) if distance > 1e-3 else (0.0, 0.0)
    along, across = wind[0] * ux + wind[1] * uy, wind[0] * uy - wind[1] * ux
    airspeed = math.sqrt((v[0] - wind[0]) ** 2 + (v[1] - wind[1]) ** 2 + (v[2] - wind[2]) ** 2)
    closing = v[0] * ux + v[1] * uy
    wanted = braking_speed(distance, max(path.airspeed + along, 4.0), along, across, gains)
    wanted = min(wanted, max(closing, gains.creep))  # what is left is crept, not flown again
    rate = table(airspeed, gains.brake_air, gains.brake_rate)
    forward = gains.k_v * (wanted - closing)
    if closing > 0.7 * wanted and distance > 1.0:
        forward -= min(rate, gains.near * max(closing, 0.0))
    forward = min(max(forward, -1.4 * rate), gains.gain)
    side = gains.k_v * (v[0] * uy - v[1] * ux)  # takes away what is not towards the end
    side = min(max(side, -gains.lateral), gains.lateral)
    above = p[2] - path.end[2]
    rise = min(max(-above, -2.2), 2.0)
    climb = table(airspeed, gains.brake_air, gains.brake_climb)
    need = _need(travel, gains)
    climb *= gains.climb_share + (1.0 - gains.climb_share) * need
    room = min(max((gains.climb_cap - above) / 2.0, 0.0), 1.0)
    climb *= max(room, 0.4 * min(max(2.0 * (need - 1.0), 0.0), 1.0))  # the cap gives way to elevons at their stops
    if climb > rise:  # while it still moves: a wind that is only held is no reason to climb
        rise += min(math.hypot(v[0], v[1]) / 3.0, 1.0) * min(airspeed / SLOW, 1.0) ** 4 * (climb - rise)
    integral[0] = integral[1] = 0.0
    integral[2] += dt * gains.k_i * min(max(rise - v[2], -2.0), 2.0)
    integral[2] = min(max(integral[2], -gains.integral_limit), gains.integral_limit)
    vertical = min(max(1.5 * (rise - v[2]) + integral[2], -3.0), 5.0)
    return np.array((forward * ux - side * uy, forward * uy + side * ux, vertical))


@njit(cache=True)
def _need(travel: float, gains: GuidanceGains) -> float:
    """How much the elevons need help: 0 to 1 as they come to the end of their travel, beyond 1 at its very end."""
    return max((travel - gains.climb_from) / (gains.climb_whole - gains.climb_from), 0.0)


@njit(cache=True)
def due_to_stop(p: Array, v: Array, wind: Array, path: Path, room: float, gains: GuidanceGains) -> bool:
    """Whether a leg that stops has no more left than ``room`` times what braking takes, or is overflown."""
    if path.kind != LEG or not path.stop:
        return False
    along, length, _ = progress(path, p)
    ex, ey = path.end[0] - p[0], path.end[1] - p[1]
    distance = math.hypot(ex, ey)
    if along >= length or distance < 1e-3:
        return True
    ux, uy = ex / distance, ey / distance
    closing = v[0] * ux + v[1] * uy
    tail, cross = wind[0] * ux + wind[1] * uy, wind[0] * uy - wind[1] * ux
    return bool(room * stopping_distance(max(closing, 0.0), tail, cross, gains) >= distance)
