"""The air of an arena as the vehicle meets it: the wind wall's jet, gusts and turbulence, period by period."""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.enclosure.jet import JET_SPREAD, Outlet, downstream, speed_share
from sitl.enclosure.turbulence import Eddies, Scales, low_altitude, stirred, turbulence
from sitl.model.airframe import Array
from sitl.model.arithmetic import sine_cosine
from sitl.model.gusts import MIN_TURNOVER_SPEED
from sitl.model.state import Body
from sitl.model.vectors import Vector, add, level_norm, norm, scaled, subtract
from sitl.storage import Kept, access

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


get_outlet = access(WindField, "outlet").get
get_eddies, put_eddies = access(WindField, "eddies")
get_part, put_part = access(WindField, "part")
get_rotation, put_rotation = access(WindField, "rotation")
get_span, get_intensity = access(WindField, "span").get, access(WindField, "intensity").get
get_length, get_wind_at_6_m = access(WindField, "length").get, access(WindField, "wind_at_6_m").get


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
def scales_at(field: Kept, place: Vector, height: float, speed: float, share: float) -> Scales:
    """Intensities and lengths of the turbulence at a place.

    Args:
        field: The field, a record.
        place: World NWU [m].
        height: Above the ground [m].
        speed: Of the wall [m/s].
        share: Of it that is left at the place.
    """
    core, mixing = get_intensity(field, 0) * speed * share, MIXING * speed * share * (1.0 - share)
    large = max(JET_SPREAD * downstream(get_outlet(field, 0), place), get_length(field, 0))
    wall, length = _weighted(core, get_length(field, 0), mixing, large)
    open_air = low_altitude(height, get_wind_at_6_m(field, 0))
    along, length_along = _weighted(wall, length, open_air.along, open_air.length_along)
    up, length_up = _weighted(wall, length, open_air.up, open_air.length_up)
    least = get_length(field, 0)
    length_along, length_up = max(length_along, least), max(length_up, least)
    return Scales(along, along, up, length_along, length_along, length_up)


@subroutine
def blow(
    field: Kept,
    body: Body,
    height: float,
    steady: Vector,
    time: float,
    noise: Array,
    schedule: Array,
    bursts: Array,
    dt: float,
) -> None:
    """The field's part of the air of a period: its velocity and its rotation at the vehicle.

    Args:
        field: The field, a record, changed in place.
        body: Where the vehicle is.
        height: Above the ground [m].
        steady: The uniform wind, world NWU [m/s].
        time: Since boot [s].
        noise: Unit normals, (4,).
        schedule: Of the wall, (n, 2).
        bursts: Its 1-cos gusts, (n, 3).
        dt: Of the period [s].
    """
    outlet, span = get_outlet(field, 0), get_span(field, 0)
    speed = max(scheduled(schedule, time) + bursting(bursts, time), 0.0)
    share = speed_share(outlet, body.position) if speed > 0.0 else 0.0
    mean, rotation = scaled(outlet.along, speed * share), Vector(0.0, 0.0, 0.0)
    if speed > 0.0:
        rotation = shear(outlet, speed, body.position, span)
    scales = scales_at(field, body.position, height, speed, share)
    base = add(steady, mean)
    airspeed = max(norm(subtract(body.velocity, base)), MIN_TURNOVER_SPEED)
    eddies = stirred(get_eddies(field, 0), (noise[0], noise[1], noise[2], noise[3]), scales, airspeed, span, dt)
    put_eddies(field, 0, eddies)
    air = turbulence(eddies, scales, span)
    level = level_norm(base.x, base.y)
    tells = level > MIN_WIND
    c, s = base.x / level if tells else outlet.along.x, base.y / level if tells else outlet.along.y
    v, w = air.velocity, air.rotation
    put_part(field, 0, Vector(mean.x + c * v.x - s * v.y, mean.y + s * v.x + c * v.y, v.z))
    put_rotation(field, 0, Vector(rotation.x + c * w.x - s * w.y, rotation.y + s * w.x + c * w.y, rotation.z + w.z))
