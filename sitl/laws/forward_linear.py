"""Gain-scheduled linear law about the level trims, for flying along a straight leg (report, section 4.1).

The law lives in the frame of the wanted *air* velocity: the world turned about the vertical so that its azimuth, which
a wind turns away from the leg's course, is north. There x = (y, n, v - v_e, e, w): the offsets from the leg to its left
and, square to the leg, upwards; the velocity less the wanted one; the attitude error; the body rates. The place along
the leg is free.

The attitude error e is the vector part of q_e^-1 ⊗ q, its sign chosen for a positive scalar part, so that eta is
bound to it by the unit sphere. The hover law's eps - eps_bar would do as well near the trim, but is a body rotation
seen through a matrix that changes with the nose's elevation: the same weights would mean another law at every speed.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Array
from sitl.kernels.state import P, Q, V, W

STATES = 11


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


@njit(cache=True)
def wind_triangle(wind: Array, course: float, climb: float, airspeed: float) -> tuple[float, float, float]:
    """The air velocity that with the wind adds up to flight along a leg, world NWU [m/s].

    Against a wind along the leg that is faster than the airspeed it drifts back along the leg; a wind across it that is
    faster is fought with all the airspeed and not overcome.

    Args:
        wind: Velocity of the air, world NWU, (3,) [m/s].
        course: Azimuth of the leg, from north to west [rad].
        climb: Angle of the leg above the horizon [rad].
        airspeed: [m/s], >= 0.
    """
    tx, ty, tz = math.cos(climb) * math.cos(course), math.cos(climb) * math.sin(course), math.sin(climb)
    along = tx * wind[0] + ty * wind[1] + tz * wind[2]
    across = max(wind[0] * wind[0] + wind[1] * wind[1] + wind[2] * wind[2] - along * along, 0.0)
    ahead = math.sqrt(max(airspeed * airspeed - across, 0.0))
    share = min(1.0, airspeed / max(math.sqrt(across), 1e-9))
    return (
        ahead * tx - share * (wind[0] - along * tx),
        ahead * ty - share * (wind[1] - along * ty),
        ahead * tz - share * (wind[2] - along * tz),
    )


@njit(cache=True)
def error(
    plant: Array,
    wind: Array,
    origin: Array,
    course: float,
    climb: float,
    airspeed: float,
    gains: ForwardGains,
    x: Array,
) -> float:
    """Deviation from flight along a leg, written into ``x`` (11,).

    Args:
        plant: Plant state, (SIZE,).
        wind: Velocity of the air, world NWU, (3,) [m/s].
        origin: A point of the leg, world NWU, (3,) [m].
        course: Azimuth of the leg over the ground, from north to west [rad]; it may jump by 20 deg, or turn with a
            circle whose tangent beside the vehicle is the leg.
        climb: Angle of the leg above the horizon [rad].
        airspeed: Wanted airspeed [m/s]; a step down costs up to 6 m of height error, a ramp of 1 m/s2 0.2 m.
        gains: Gains of the law.
        x: Receives (y, n, v - v_e, e, w), see the module.

    Returns:
        Climb of the air velocity [rad], which without wind is the leg's: what :func:`control` trims for.
    """
    c, s = math.cos(course), math.sin(course)
    north, west, up = plant[P] - origin[0], plant[P + 1] - origin[1], plant[P + 2] - origin[2]
    x[0] = c * west - s * north
    x[1] = math.cos(climb) * up - math.sin(climb) * (c * north + s * west)

    ux, uy, uz = wind_triangle(wind, course, climb, airspeed)
    level = math.hypot(ux, uy)
    steep = math.atan2(uz, level) if level > 1e-6 else climb
    azimuth = math.atan2(uy, ux) if level > 1e-6 else course
    c, s = math.cos(azimuth), math.sin(azimuth)
    dx, dy = plant[V] - wind[0] - ux, plant[V + 1] - wind[1] - uy
    x[2], x[3], x[4] = c * dx + s * dy, c * dy - s * dx, plant[V + 2] - wind[2] - uz

    i, a = _cell(airspeed, gains.speeds)
    j, b = _cell(steep, gains.climbs)
    _attitude_error(plant, azimuth, _bilinear(gains.theta, i, a, j, b), x)
    x[8], x[9], x[10] = plant[W], plant[W + 1], plant[W + 2]
    return steep


@njit(cache=True)
def control(x: Array, airspeed: float, climb: float, gains: ForwardGains, u: Array) -> None:
    """Commands u = u_e - K x, not limited, written into ``u`` (4,): T1, T2 [N], d1, d2 [rad].

    The offset from the leg is shortened to ``gains.reach``, so that from far away the vehicle flies towards the leg at
    an angle instead of turning square to it.

    Args:
        x: Deviation from the leg, (11,).
        airspeed: Wanted airspeed [m/s].
        climb: Climb of the air velocity, as :func:`error` returned it [rad].
        gains: Gains of the law.
        u: Receives the commands.
    """
    i, a = _cell(airspeed, gains.speeds)
    j, b = _cell(climb, gains.climbs)
    thrust, delta = _bilinear(gains.thrust, i, a, j, b), _bilinear(gains.delta, i, a, j, b)
    near = min(1.0, gains.reach / max(math.hypot(x[0], x[1]), 1e-9))
    for row in range(4):
        value = thrust if row < 2 else delta
        for column in range(STATES):
            gain = (1.0 - a) * gains.K[i, row, column] + a * gains.K[i + 1, row, column]
            value -= gain * x[column] * (near if column < 2 else 1.0)
        u[row] = value


@njit(cache=True)
def lyapunov(x: Array, airspeed: float, gains: ForwardGains) -> float:
    """V = x' S x with S of the airspeed."""
    i, a = _cell(airspeed, gains.speeds)
    value = 0.0
    for row in range(STATES):
        for column in range(STATES):
            entry = (1.0 - a) * gains.S[i, row, column] + a * gains.S[i + 1, row, column]
            value += x[row] * entry * x[column]
    return value


@njit(cache=True)
def _attitude_error(plant: Array, azimuth: float, theta: float, x: Array) -> None:
    """Vector part of q_e^-1 ⊗ q, q_e the trim's attitude, written into x[5:8]."""
    ca, sa = math.cos(0.5 * azimuth), math.sin(0.5 * azimuth)
    qw, qx, qy, qz = plant[Q], plant[Q + 1], plant[Q + 2], plant[Q + 3]
    # q_z(-azimuth) ⊗ q, then q_y(theta) ⊗ that: nose-up is a negative turn about y
    w, i, j, k = ca * qw + sa * qz, ca * qx + sa * qy, ca * qy - sa * qx, ca * qz - sa * qw
    ct, st = math.cos(0.5 * theta), math.sin(0.5 * theta)
    sign = 1.0 if ct * w - st * j >= 0.0 else -1.0
    x[5], x[6], x[7] = sign * (ct * i + st * k), sign * (ct * j + st * w), sign * (ct * k - st * i)


@njit(cache=True)
def _cell(value: float, grid: Array) -> tuple[int, float]:
    """Index of an even grid's cell and the place in it, 0..1; beyond the ends, the end."""
    last = grid.size - 2
    place = (value - grid[0]) / (grid[1] - grid[0])
    place = min(max(place, 0.0), last + 1.0)
    i = min(int(place), last)
    return i, place - i


@njit(cache=True)
def _bilinear(table: Array, i: int, a: float, j: int, b: float) -> float:
    low = (1.0 - b) * table[i, j] + b * table[i, j + 1]
    return float((1.0 - a) * low + a * ((1.0 - b) * table[i + 1, j] + b * table[i + 1, j + 1]))


def scheduled(gains: ForwardGains, airspeed: float) -> tuple[Array, Array]:
    """K (4, 11) and S (11, 11) in force at an airspeed [m/s]."""
    i, a = _cell(airspeed, gains.speeds)
    return np.asarray((1.0 - a) * gains.K[i] + a * gains.K[i + 1]), np.asarray(
        (1.0 - a) * gains.S[i] + a * gains.S[i + 1]
    )
