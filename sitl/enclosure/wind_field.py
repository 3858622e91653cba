"""The air of an arena as the vehicle meets it: the wind wall's jet, gusts and turbulence, period by period."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.enclosure.turbulence import Eddies, Scales, low_altitude, stirred, turbulence
from sitl.enclosure.wind_wall import JET_SPREAD, Outlet, downstream, speed_share
from sitl.model.airframe import Array
from sitl.model.arithmetic import sine_cosine
from sitl.model.gusts import MIN_TURNOVER_SPEED
from sitl.model.state import Body
from sitl.model.vectors import Vector, add, level_norm, norm, scaled, subtract
from sitl.storage import value_of, writer

MIN_WIND = 0.1  # less tells no direction [m/s]
MIN_DEVIATION = 1e-9  # keeps a division finite [m/s]
MIXING = 0.66  # deviation in the mixing layer over U_0 m (1 - m), m the share of U_0: 0.165 U_0 at its middle


class WindField(NamedTuple):
    """The wind field besides the uniform wind and its gusts, and its gust and rotation of the last period."""

    outlet: Outlet
    intensity: float  # of the wall's own turbulence [-]
    length: float  # of it [m]
    wind_at_6_m: float  # by which there is turbulence of the open air; 0: none [m/s]
    span: float  # of the wing [m]
    eddies: Eddies
    part: Vector  # of the gust that is this field's, world NWU [m/s]
    rotation: Vector  # of the air, world NWU [rad/s]
    touched: int  # number of the solid that was touched, from 1; 0: none


class Wall(NamedTuple):
    """The schedule and the gusts of the wind wall."""

    schedule: Array  # time and speed, (n, 2) [s], [m/s]
    bursts: Array  # 1-cos gusts: begin, duration and rise, (n, 3) [s], [s], [m/s]


class Weather(NamedTuple):
    """The air without the field, where the vehicle is, and the time."""

    height: float  # above the ground [m]
    steady: Vector  # the uniform wind, world NWU [m/s]
    time: float  # since boot [s]


put_eddies = writer(WindField, lambda field: field.eddies)
put_part = writer(WindField, lambda field: field.part)
put_rotation = writer(WindField, lambda field: field.rotation)


@subroutine
def scheduled(schedule: Array, time: float) -> float:
    """The speed of a schedule, (n, 2) of time and speed, at a time [s]: before its first line that line's [m/s]."""
    speed = schedule[0, 1] if schedule.shape[0] > 0 else 0.0
    for i in range(schedule.shape[0]):
        if schedule[i, 0] <= time:
            speed = schedule[i, 1]
            if i + 1 < schedule.shape[0] and schedule[i + 1, 0] > time:
                share = (time - schedule[i, 0]) / (schedule[i + 1, 0] - schedule[i, 0])
                speed += share * (schedule[i + 1, 1] - schedule[i, 1])
    return speed


@subroutine
def bursting(bursts: Array, time: float) -> float:
    """Speed that 1-cos gusts, (n, 3) of begin, duration and rise, add at a time [m/s]."""
    total = 0.0
    for i in range(bursts.shape[0]):
        share = (time - bursts[i, 0]) / bursts[i, 1]
        if 0.0 < share < 1.0:
            total += 0.5 * bursts[i, 2] * (1.0 - sine_cosine(2.0 * math.pi * share)[1])
    return total


@subroutine
def shear(outlet: Outlet, speed: float, place: Vector, span: float) -> Vector:
    """The jet's mean shear over the span, as a rotation of the air, world NWU [rad/s]."""
    half = 0.5 * span
    left = Vector(-half * outlet.along.y, half * outlet.along.x, 0.0)
    across = speed_share(outlet, add(place, left)) - speed_share(outlet, subtract(place, left))
    above = Vector(place.x, place.y, place.z + half)
    below = Vector(place.x, place.y, place.z - half)
    upright = speed * (speed_share(outlet, above) - speed_share(outlet, below)) / span
    return Vector(-outlet.along.y * upright, outlet.along.x * upright, -speed * across / span)


@kernel
def _weighted(first: float, length: float, second: float, other: float) -> tuple[float, float]:
    """Deviation and length of two turbulences together, the length by their variances."""
    one, two = first * first, second * second
    total = one + two
    return math.sqrt(total), (one * length + two * other) / max(total, MIN_DEVIATION * MIN_DEVIATION)


@subroutine
def scales_at(field: WindField, place: Vector, height: float, speed: float, share: float) -> Scales:
    """Intensities and lengths of the turbulence at a place.

    Args:
        field: The field, a record.
        place: World NWU [m].
        height: Above the ground [m].
        speed: Of the wall [m/s].
        share: Of it that is left at the place.
    """
    core, mixing = field.intensity * speed * share, MIXING * speed * share * (1.0 - share)
    large = max(JET_SPREAD * downstream(value_of(field.outlet), place), field.length)
    wall, length = _weighted(core, field.length, mixing, large)
    open_air = low_altitude(height, field.wind_at_6_m)
    along, length_along = _weighted(wall, length, open_air.along, open_air.length_along)
    up, length_up = _weighted(wall, length, open_air.up, open_air.length_up)
    least = field.length
    length_along, length_up = max(length_along, least), max(length_up, least)
    return Scales(
        along=along, across=along, up=up, length_along=length_along, length_across=length_along, length_up=length_up
    )


@subroutine
def blow(field: WindField, body: Body, weather: Weather, wall: Wall, normals: Array, dt: float) -> None:
    """The field's part of the air of a period: its velocity and its rotation at the vehicle.

    Args:
        field: The field, a record, changed in place.
        body: Where the vehicle is.
        weather: The air without the field.
        wall: What the wind wall blows.
        normals: Unit normals, (4,).
        dt: Of the period [s].
    """
    outlet, span = value_of(field.outlet), field.span
    speed = max(scheduled(wall.schedule, weather.time) + bursting(wall.bursts, weather.time), 0.0)
    share = speed_share(outlet, body.position) if speed > 0.0 else 0.0
    mean, rotation = scaled(outlet.along, speed * share), Vector(0.0, 0.0, 0.0)
    if speed > 0.0:
        rotation = shear(outlet, speed, body.position, span)
    scales = scales_at(field, body.position, weather.height, speed, share)
    base = add(weather.steady, mean)
    airspeed = max(norm(subtract(body.velocity, base)), MIN_TURNOVER_SPEED)
    eddies = stirred(
        value_of(field.eddies), (normals[0], normals[1], normals[2], normals[3]), scales, airspeed, span, dt
    )
    put_eddies(field, eddies)
    air = turbulence(eddies, scales, span)
    level = level_norm(base.x, base.y)
    tells = level > MIN_WIND
    c, s = base.x / level if tells else outlet.along.x, base.y / level if tells else outlet.along.y
    v, w = air.velocity, air.rotation
    put_part(field, Vector(mean.x + c * v.x - s * v.y, mean.y + s * v.x + c * v.y, v.z))
    put_rotation(field, Vector(rotation.x + c * w.x - s * w.y, rotation.y + s * w.x + c * w.y, rotation.z + w.z))
