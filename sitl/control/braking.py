"""The acceleration set-point that ends a forward flight: the climbing stop at the end of a leg.

The elevons rule everything here. Level flight between 4.5 and 7 m/s takes nearly all of their travel, and braking
there takes more: a level deceleration of 1 m/s2 already saturates them, the nose cannot rise, and the vehicle slides on
for fifty metres or dives. But *climbing* through that corridor lowers the incidence: at 2.5 m/s upwards even
2.5 m/s2 leaves a quarter of the travel. So braking climbs a few metres, and stops sooner for it.
"""

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.control.forward_flight.forward_guidance import (
    SLOW,
    STEPS,
    GuidanceGains,
    Guided,
    MotionInAir,
    at_airspeed,
)
from sitl.control.reference import Path
from sitl.model.arithmetic import clipped
from sitl.model.vectors import Vector, level_norm, norm, subtract

HOVERED = 0.5  # of the creep, at which it creeps where the limit of the hover is less than that [-]


class Stop(NamedTuple):
    """Path to stop at the end of, and speed at which a hover would fly there."""

    path: Path
    speed: float  # horizontal limit of the hover [m/s]


@subroutine
def braking_speed(distance: float, limit: float, along: float, across: float, gains: GuidanceGains) -> float:
    """Speed over the ground from which the profile stops within a distance, at most ``limit`` [m/s]."""
    step = limit / (2 * STEPS)
    total = 0.0
    for i in range(2 * STEPS):
        middle = (i + 0.5) * step
        rate = at_airspeed(level_norm(middle - along, across), gains.brake_rate)
        part = max(middle * step / rate, step / gains.near)
        total += part
        if total > distance:
            return min(step * (i + max(0.0, 1.0 - (total - distance) / part)), distance * gains.near)
    return limit


@kernel
def brake(flown: MotionInAir, stop: Stop, travel: float, integral: Vector, dt: float, gains: GuidanceGains) -> Guided:
    """Acceleration of the climbing stop at the end of a leg, and the next integral.

    Arguments as for :func:`cruise`, and ``travel``: the share of the elevons' that pitch uses now.
    """
    p, v, wind, path, speed = flown.position, flown.velocity, flown.wind, stop.path, stop.speed
    x, y = path.end.x - p.x, path.end.y - p.y
    distance = level_norm(x, y)
    ux, uy = (x / distance, y / distance) if distance > 1e-3 else (0.0, 0.0)
    along, across = wind.x * ux + wind.y * uy, wind.x * uy - wind.y * ux
    airspeed = norm(subtract(v, wind))
    closing = v.x * ux + v.y * uy
    profile = braking_speed(distance, max(path.airspeed + along, 4.0), along, across, gains)
    creeps = speed < gains.creep
    crept = min(HOVERED * gains.creep, speed) if creeps else gains.creep
    wanted = min(profile, max(closing, crept))  # what is left is crept, not flown again
    rate = at_airspeed(airspeed, gains.brake_rate)
    forward = gains.k_v * (wanted - closing)
    fed = min(rate, gains.near * max(closing, 0.0)) if closing > 0.7 * wanted and distance > 1.0 else 0.0
    forward -= fed * (_begun(closing, profile, crept) if creeps else 1.0)
    forward = clipped(forward, -1.4 * rate, gains.max_forward)
    side = gains.k_v * (v.x * uy - v.y * ux)  # takes away what is not towards the end
    side = clipped(side, -gains.min_turn, gains.min_turn)
    rise = _braking_rise(p.z - path.end.z, level_norm(v.x, v.y), airspeed, travel, gains)
    after = integral.z + dt * gains.k_i * clipped(rise - v.z, -2.0, 2.0)
    after = clipped(after, -gains.max_integral, gains.max_integral)
    vertical = clipped(1.5 * (rise - v.z) + after, -3.0, 5.0)
    return Guided(Vector(forward * ux - side * uy, forward * uy + side * ux, vertical), Vector(0.0, 0.0, after))


@kernel
def _begun(closing: float, profile: float, crept: float) -> float:
    """Share of the planned deceleration at the end of a hover: all of it in the braking, none while it creeps.

    It sets in gradually: a step of it adds to the speed first, since the elevons push to raise the nose.

    Args:
        closing: Speed towards the end [m/s].
        profile: What the braking profile allows [m/s].
        crept: What the way is crept at [m/s].
    """
    return clipped(max(crept - profile, closing - crept) / (0.2 * crept), 0.0, 1.0)


@kernel
def _braking_rise(above: float, speed: float, airspeed: float, travel: float, gains: GuidanceGains) -> float:
    """Vertical speed of the climbing stop [m/s].

    Args:
        above: Height over the end [m].
        speed: Over the ground [m/s].
        airspeed: [m/s].
        travel: Share of the elevons' that pitch uses now.
        gains: Gains with the braking table.
    """
    rise = clipped(-above, -2.2, 2.0)
    need = _need(travel, gains)
    climb = at_airspeed(airspeed, gains.brake_climb) * (gains.climb_share + (1.0 - gains.climb_share) * need)
    room = clipped((gains.max_climb - above) / 2.0, 0.0, 1.0)
    climb *= max(room, 0.4 * clipped(2.0 * (need - 1.0), 0.0, 1.0))  # the limit gives way to elevons at their stops
    # While it still moves: a wind that is only held is no reason to climb.
    carried = min(airspeed / SLOW, 1.0)
    carried = carried * carried
    return rise + min(speed / 3.0, 1.0) * (carried * carried) * max(climb - rise, 0.0)


@kernel
def _need(travel: float, gains: GuidanceGains) -> float:
    """The elevons' need of help: 0 to 1 as they come to the end of their travel, beyond 1 at its very end."""
    return max((travel - gains.climb_from) / (gains.climb_full - gains.climb_from), 0.0)
