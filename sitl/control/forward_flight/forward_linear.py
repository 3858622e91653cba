"""Gain-scheduled linear law about the level trims, for flying along a straight leg (report, section 4.1).

The law lives in the frame of the wanted *air* velocity: the world turned about the vertical so that its azimuth, which
a wind turns away from the leg's course, is north. There x = (y, n, v - v_e, e, w): the offsets from the leg to its left
and, square to the leg, upwards; the velocity less the wanted one; the attitude error; the body rates. The place along
the leg is free.

The attitude error e is the vector part of q_e^-1 ⊗ q, its sign chosen for a positive scalar part, so that eta is
bound to it by the unit sphere. The hover law's eps - eps_bar would do as well near the trim, but is a body rotation
seen through a matrix that changes with the nose's elevation: the same weights would mean another law at every speed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.control.allocation import Virtual, allocate
from sitl.control.estimate import Estimate, air_ahead
from sitl.control.reference import LEG, Path, Reference
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import arctangent, clipped, sine_cosine
from sitl.model.propeller import thrust
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, dot, level_norm


class ForwardGains(NamedTuple):
    """Gains and trims over evenly spaced airspeeds, trims over evenly spaced climbs besides."""

    speeds: Array  # (n,) airspeeds from zero up [m/s]
    climbs: Array  # (k,) angles of the air path above the horizon [rad]
    K: Array  # (n, 4, 11); the columns are the entries of x, the rows T1, T2 [N], d1, d2 [rad]
    S: Array  # (n, 11, 11), V = x' S x
    theta: Array  # (n, k), the nose above the horizon [rad]
    thrust: Array  # (n, k), of each motor [N]
    delta: Array  # (n, k), of each elevon [rad]
    reach: float = 4.0  # offsets from the leg beyond this count as this [m]


class ForwardError(NamedTuple):
    """Deviation x from flight along a leg; velocities in the frame of the wanted air velocity."""

    left: float  # y, offset from the leg to its left [m]
    above: float  # n, square to the leg, upwards [m]
    v_ahead: float  # velocity less the wanted one [m/s]
    v_left: float
    v_up: float
    e_x: float  # vector part of the attitude error [-]
    e_y: float
    e_z: float
    p: float  # body rates [rad/s]
    q: float
    r: float


class Cell(NamedTuple):
    """A place on an evenly spaced grid."""

    point: int  # before it
    share: float  # of the way to the next, 0..1


@kernel
def step(estimate: Estimate, reference: Reference, gains: ForwardGains, a: Airframe) -> tuple[Actuators, int]:
    """One tick: commands and DARKO_SATURATION bits."""
    path = reference.path
    x, steep = error(estimate, path, gains)
    T1, T2, d1, d2 = control(x, path.airspeed, steep, gains)
    inflow = air_ahead(estimate)
    least, high = a.k_f * (a.omega_min * a.omega_min) + a.k_fw * a.omega_min, thrust(a.omega_max, inflow, a)
    virtual = Virtual(T1, T2, d1 * clipped(T1, least, high), d2 * clipped(T2, least, high))
    return allocate(virtual, a, inflow)


@kernel
def lyapunov(estimate: Estimate, reference: Reference, gains: ForwardGains) -> float:
    """V = x' S x with S of the wanted airspeed; infinite on a circle, which this law does not fly."""
    x, _ = error(estimate, reference.path, gains)
    value = quadratic(x, reference.path.airspeed, gains)
    return value if reference.path.kind == LEG else math.inf


@kernel
def wind_triangle(wind: Vector, along_leg: Vector, airspeed: float) -> Vector:
    """The air velocity that with the wind adds up to flight along a leg, world NWU [m/s].

    Against a wind along the leg that is faster than the airspeed it drifts back along the leg; a wind across it that is
    faster is fought with all the airspeed and not overcome.

    Args:
        wind: Velocity of the air, world NWU [m/s].
        along_leg: Unit vector of the leg, world NWU.
        airspeed: [m/s], >= 0.
    """
    along = dot(along_leg, wind)
    across = max(dot(wind, wind) - along * along, 0.0)
    ahead = math.sqrt(max(airspeed * airspeed - across, 0.0))
    share = min(1.0, airspeed / max(math.sqrt(across), 1e-9))
    return Vector(
        ahead * along_leg.x - share * (wind.x - along * along_leg.x),
        ahead * along_leg.y - share * (wind.y - along * along_leg.y),
        ahead * along_leg.z - share * (wind.z - along * along_leg.z),
    )


@kernel
def error(estimate: Estimate, path: Path, gains: ForwardGains) -> tuple[ForwardError, float]:
    """Deviation from flight along a leg, and the climb of the air velocity.

    Without wind the latter is the leg's; it is what :func:`control` trims for [rad]. The leg may turn by 20 deg at
    once, or be the tangent of a circle beside the vehicle. A step down of its airspeed costs up to 6 m of height error,
    a ramp of 1 m/s2 0.2 m.
    """
    north, west, up = path.end.x - path.start.x, path.end.y - path.start.y, path.end.z - path.start.z
    c, s = _direction(north, west, 1.0, 0.0)  # of the leg's course, then of its climb
    cc, sc = _direction(level_norm(north, west), up, 1.0, 0.0)
    p, v, wind = estimate.position, estimate.velocity, estimate.wind
    x, y, z = p.x - path.start.x, p.y - path.start.y, p.z - path.start.z
    left, above = c * y - s * x, cc * z - sc * (c * x + s * y)

    wanted = wind_triangle(wind, Vector(cc * c, cc * s, sc), path.airspeed)
    level = level_norm(wanted.x, wanted.y)
    moves = level > 1e-6
    steep = arctangent(wanted.z if moves else sc, level if moves else cc)
    c, s = _direction(wanted.x, wanted.y, c, s)
    x, y, z = v.x - wind.x - wanted.x, v.y - wind.y - wanted.y, v.z - wind.z - wanted.z
    theta = bilinear(gains.theta, cell(path.airspeed, gains.speeds), cell(steep, gains.climbs))
    e = _attitude_error(estimate.attitude, c, s, theta)
    w = estimate.rates
    return ForwardError(
        left=left,
        above=above,
        v_ahead=c * x + s * y,
        v_left=c * y - s * x,
        v_up=z,
        e_x=e.x,
        e_y=e.y,
        e_z=e.z,
        p=w.x,
        q=w.y,
        r=w.z,
    ), steep


@kernel
def control(x: ForwardError, airspeed: float, climb: float, gains: ForwardGains) -> tuple[float, float, float, float]:
    """Commands u = u_e - K x, not limited: T1, T2 [N], d1, d2 [rad].

    The offset from the leg is shortened to ``gains.reach``, so that from far away the vehicle flies towards the leg at
    an angle instead of turning square to it.

    Args:
        x: Deviation from the leg.
        airspeed: Wanted airspeed [m/s].
        climb: Climb of the air velocity, as :func:`error` gave it [rad].
        gains: Gains of the law.
    """
    at, up = cell(airspeed, gains.speeds), cell(climb, gains.climbs)
    thrust, delta = bilinear(gains.thrust, at, up), bilinear(gains.delta, at, up)
    near = min(1.0, gains.reach / max(level_norm(x.left, x.above), 1e-9))
    x = ForwardError(
        left=near * x.left,
        above=near * x.above,
        v_ahead=x.v_ahead,
        v_left=x.v_left,
        v_up=x.v_up,
        e_x=x.e_x,
        e_y=x.e_y,
        e_z=x.e_z,
        p=x.p,
        q=x.q,
        r=x.r,
    )
    return (
        thrust - _feedback(gains.K, at, 0, x),
        thrust - _feedback(gains.K, at, 1, x),
        delta - _feedback(gains.K, at, 2, x),
        delta - _feedback(gains.K, at, 3, x),
    )


@kernel
def quadratic(x: ForwardError, airspeed: float, gains: ForwardGains) -> float:
    """V = x' S x with S of the airspeed [m/s]."""
    i, share = cell(airspeed, gains.speeds)
    low, high = _form(gains.S, i, x), _form(gains.S, i + 1, x)
    return low + share * (high - low)


@kernel
def cell(value: float, grid: Array) -> Cell:
    """Cell and fraction of a value on an even grid; beyond the ends, the end."""
    place = min(max(0.0, (value - grid[0]) / (grid[1] - grid[0])), grid.size - 1.0)  # of a NaN, 0
    i = min(int(place), grid.size - 2)
    return Cell(i, place - i)


@kernel
def bilinear(table: Array, at: Cell, up: Cell) -> float:
    """Value of a table over airspeeds and climbs."""
    i, a = at
    j, b = up
    low = (1.0 - b) * table[i, j] + b * table[i, j + 1]
    return float((1.0 - a) * low + a * ((1.0 - b) * table[i + 1, j] + b * table[i + 1, j + 1]))


@kernel
def _direction(x: float, y: float, otherwise_x: float, otherwise_y: float) -> tuple[float, float]:
    """The unit vector along (x, y); the other one where that has no direction."""
    size = level_norm(x, y)
    return (x / size, y / size) if size > 1e-6 else (otherwise_x, otherwise_y)


@kernel
def _attitude_error(q: Quaternion, c: float, s: float, theta: float) -> Vector:
    """Vector part of q_e^-1 ⊗ q, q_e the trim's attitude: its azimuth has cosine c and sine s, its nose is up theta."""
    # Cosine and sine of half the azimuth: the larger from a root, the other from it.
    large = math.sqrt(0.5 + 0.5 * abs(c))
    small = 0.5 * s / large
    ca, sa = (large, small) if c >= 0.0 else (small, large)
    # q_z(-azimuth) ⊗ q, then q_y(theta) ⊗ that: nose-up is a negative turn about y
    w, i, j, k = ca * q.w + sa * q.z, ca * q.x + sa * q.y, ca * q.y - sa * q.x, ca * q.z - sa * q.w
    st, ct = sine_cosine(0.5 * theta)
    sign = 1.0 if ct * w - st * j >= 0.0 else -1.0
    return Vector(sign * (ct * i + st * k), sign * (ct * j + st * w), sign * (ct * k - st * i))


@kernel
def _feedback(K: Array, at: Cell, row: int, x: ForwardError) -> float:
    """A row of K x."""
    low, high = _product(K, at.point, row, x), _product(K, at.point + 1, row, x)
    return low + at.share * (high - low)


@kernel
def _product(K: Array, i: int, row: int, x: ForwardError) -> float:
    product = K[i, row, 0] * x[0] + K[i, row, 1] * x[1] + K[i, row, 2] * x[2] + K[i, row, 3] * x[3]
    product += K[i, row, 4] * x[4] + K[i, row, 5] * x[5] + K[i, row, 6] * x[6] + K[i, row, 7] * x[7]
    return float(product + (K[i, row, 8] * x[8] + K[i, row, 9] * x[9] + K[i, row, 10] * x[10]))


@kernel
def _form(S: Array, i: int, x: ForwardError) -> float:
    """The form x' S x at one airspeed of the schedule: S is symmetric, entries off the diagonal count twice."""
    x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10 = x
    own = S[i, 0, 0] * x0 * x0 + S[i, 1, 1] * x1 * x1 + S[i, 2, 2] * x2 * x2 + S[i, 3, 3] * x3 * x3
    own += S[i, 4, 4] * x4 * x4 + S[i, 5, 5] * x5 * x5 + S[i, 6, 6] * x6 * x6 + S[i, 7, 7] * x7 * x7
    own += S[i, 8, 8] * x8 * x8 + S[i, 9, 9] * x9 * x9 + S[i, 10, 10] * x10 * x10
    off = x0 * (S[i, 0, 1] * x1 + S[i, 0, 2] * x2 + S[i, 0, 3] * x3 + S[i, 0, 4] * x4 + S[i, 0, 5] * x5)
    off += x0 * (S[i, 0, 6] * x6 + S[i, 0, 7] * x7 + S[i, 0, 8] * x8 + S[i, 0, 9] * x9 + S[i, 0, 10] * x10)
    off += x1 * (S[i, 1, 2] * x2 + S[i, 1, 3] * x3 + S[i, 1, 4] * x4 + S[i, 1, 5] * x5 + S[i, 1, 6] * x6)
    off += x1 * (S[i, 1, 7] * x7 + S[i, 1, 8] * x8 + S[i, 1, 9] * x9 + S[i, 1, 10] * x10)
    off += x2 * (S[i, 2, 3] * x3 + S[i, 2, 4] * x4 + S[i, 2, 5] * x5 + S[i, 2, 6] * x6)
    off += x2 * (S[i, 2, 7] * x7 + S[i, 2, 8] * x8 + S[i, 2, 9] * x9 + S[i, 2, 10] * x10)
    off += x3 * (S[i, 3, 4] * x4 + S[i, 3, 5] * x5 + S[i, 3, 6] * x6 + S[i, 3, 7] * x7)
    off += x3 * (S[i, 3, 8] * x8 + S[i, 3, 9] * x9 + S[i, 3, 10] * x10)
    off += x4 * (S[i, 4, 5] * x5 + S[i, 4, 6] * x6 + S[i, 4, 7] * x7)
    off += x4 * (S[i, 4, 8] * x8 + S[i, 4, 9] * x9 + S[i, 4, 10] * x10)
    off += x5 * (S[i, 5, 6] * x6 + S[i, 5, 7] * x7 + S[i, 5, 8] * x8 + S[i, 5, 9] * x9 + S[i, 5, 10] * x10)
    off += x6 * (S[i, 6, 7] * x7 + S[i, 6, 8] * x8 + S[i, 6, 9] * x9 + S[i, 6, 10] * x10)
    off += x7 * (S[i, 7, 8] * x8 + S[i, 7, 9] * x9 + S[i, 7, 10] * x10)
    off += x8 * (S[i, 8, 9] * x9 + S[i, 8, 10] * x10)
    off += x9 * S[i, 9, 10] * x10
    return float(own + 2.0 * off)


def scheduled(gains: ForwardGains, airspeed: float) -> tuple[Array, Array]:
    """K (4, 11) and S (11, 11) in force at an airspeed [m/s]."""
    i, a = cell(airspeed, gains.speeds)
    return (1.0 - a) * gains.K[i] + a * gains.K[i + 1], (1.0 - a) * gains.S[i] + a * gains.S[i + 1]
