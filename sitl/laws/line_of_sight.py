r"""Non-linear forward law: line of sight -> acceleration -> attitude and thrust -> moment -> actuators.

The structure is the report's (section 4.2); three of its links are others. The force wanted fixes the attitude
exactly: with :math:`C_{l,e} = C_l (1 - \xi_f / \xi_m)` the normal force of the trimmed wing, and the span square to the
air stream,

.. math::
    x_d \parallel m (a + g e_3) + \tfrac12 \rho S |v_a| C_{l,e} (v_a - (v_a \cdot y) y)

is right in quasi-steady flight at any incidence and without an airspeed is the zero-moment law's thrust direction, so
the same law tips over, cruises, turns (banking) and stands up again. The moment follows an attitude that moves, and the
allocation inverts the model in closed form. The report's own law is :mod:`sitl.laws.report_forward`.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import conjugate, multiply, rotate, rotate_inverse
from sitl.kernels.state import ACTUATOR, P, Q, V, W
from sitl.laws import moment_observer
from sitl.laws.forward_allocation import invert, thrusts_of
from sitl.laws.forward_guidance import GuidanceGains, arrest, brake, cruise
from sitl.laws.path import Path

CRUISE, BRAKE, ARREST = 0, 1, 2  # what it is used for: follow the path, stop at its end, stop here

# The law's state.
WANTED = 0  # acceleration wanted last tick, world, 3 entries [m/s2]; NaN: the law has just begun
ATTITUDE = 3  # q_d of the last tick, 4 entries
TURNING = 7  # filtered rate of q_d, in its own frame, 3 entries [rad/s]
INTEGRAL = 10  # of the velocity error along the course, to its left and upwards, 3 entries [m/s2]
OBSERVER = 13  # of the moment disturbance, 3 entries [N m s]
SIZE = 16


class SightGains(NamedTuple):
    """Gains of the law."""

    guidance: GuidanceGains
    attitude: Array  # bandwidth of the attitude loop about x, y, z_b, (3,) [rad/s]
    rate: Array  # bandwidth of the rate loop, (3,) [rad/s]
    most_rate: float  # body rate asked for at most [rad/s]
    observer: float  # bandwidth of the moment's disturbance observer [rad/s]
    turn_filter: float  # bandwidth of the feed-forward of q_d's own rate [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


@njit(cache=True)
def reset(plant: Array, law: Array, a: Airframe) -> None:
    """Jump map on entering the law: it begins from the attitude as it is, with nothing accumulated."""
    law[:] = 0.0
    law[WANTED : WANTED + 3] = math.nan
    law[ATTITUDE : ATTITUDE + 4] = plant[Q : Q + 4]
    moment_observer.reset(plant, law[OBSERVER : OBSERVER + moment_observer.SIZE], a)


@njit(cache=True)
def control(
    plant: Array,
    law: Array,
    path: Path,
    wind: Array,
    heading: float,
    phase: int,
    acceleration: Array,
    gains: SightGains,
    a: Airframe,
    dt: float,
    command: Array,
) -> int:
    """One tick: actuator commands into ``command`` (w1, w2 [rad/s], d1, d2 [rad]), the law's state advanced.

    Args:
        plant: Plant state.
        law: The law's state, (SIZE,), changed in place.
        path: What to follow.
        wind: Velocity of the air as it is known, world NWU, (3,) [m/s].
        heading: Where the belly points while there is no airspeed to point it [rad].
        phase: CRUISE, BRAKE or ARREST.
        acceleration: The vehicle's present acceleration, world, (3,) [m/s2]: where the wanted one begins.
        gains: Gains of the law.
        a: The airframe as the law knows it.
        dt: Tick [s].
        command: Receives the commands.

    Returns:
        DARKO_GIVEN_UP bits.
    """
    p, v, q, w = plant[P : P + 3], plant[V : V + 3], plant[Q : Q + 4], plant[W : W + 3]
    limits = gains.guidance
    integral = law[INTEGRAL : INTEGRAL + 3]
    travel = 0.5 * abs(plant[ACTUATOR + 2] + plant[ACTUATOR + 3]) / a.delta_max
    if phase == BRAKE:
        wanted = brake(p, v, wind, path, travel, integral, dt, limits)
    elif phase == ARREST:
        wanted = arrest(v, wind, travel, limits)
    else:
        wanted = guarded(v, cruise(p, v, wind, path, integral, dt, limits))
    previous = law[WANTED : WANTED + 3]
    if math.isnan(previous[0]):
        previous[:] = acceleration
    _limit_jerk(wanted, previous, limits.jerk * dt)
    wanted[2] = min(max(wanted[2], -limits.down), limits.up)
    previous[:] = wanted

    force = a.m * wanted
    force[2] += a.m * a.g
    v_a = v - wind
    q_d = attitude(force, v_a, heading, law[ATTITUDE : ATTITUDE + 4], gains, a)
    observer = law[OBSERVER : OBSERVER + moment_observer.SIZE]
    disturbance = moment_observer.update(plant, wind, observer, gains.observer, a, dt)
    moment = _moment(q, w, q_d, law, gains, a, dt) - disturbance
    x_b = rotate(q, np.array((1.0, 0.0, 0.0)))
    axial = force[0] * x_b[0] + force[1] * x_b[1] + force[2] * x_b[2]
    thrusts = thrusts_of(plant[ACTUATOR : ACTUATOR + 2], a)
    return int(invert(axial, moment, rotate_inverse(q, v_a), w, thrusts, a, command))


@njit(cache=True)
def guarded(v: Array, wanted: Array) -> Array:
    """The acceleration wanted, or a pull-up where the vehicle dives."""
    speed = math.hypot(v[0], v[1])
    if v[2] < -4.5 and -v[2] > 0.404 * speed:  # steeper than 22 deg
        return np.array((0.0, 0.0, min(2.0 * (1.0 - v[2]), 8.0)))
    return wanted


@njit(cache=True)
def _limit_jerk(wanted: Array, previous: Array, most: float) -> None:
    change = wanted - previous
    size = math.sqrt(change[0] ** 2 + change[1] ** 2 + change[2] ** 2)
    if size > most:
        wanted[:] = previous + change * (most / size)


@njit(cache=True)
def attitude(force: Array, v_a: Array, heading: float, last: Array, gains: SightGains, a: Airframe) -> Array:
    """The attitude that gives a force in quasi-steady flight, (4,).

    Args:
        force: Aerodynamic force wanted, world, (3,) [N].
        v_a: Velocity through the air, world, (3,) [m/s].
        heading: Of the belly without airspeed [rad].
        last: The attitude before, whose sign and, where nothing else decides, whose span is kept, (4,).
        gains: The blend between heading and air stream.
        a: The airframe as the law knows it.
    """
    speed = math.sqrt(v_a[0] ** 2 + v_a[1] ** 2 + v_a[2] ** 2)
    # Only air that comes from ahead may take the heading over: a tail wind at the stop would turn it round.
    meeting = v_a[0] * math.cos(heading) + v_a[1] * math.sin(heading)
    share = min(max((meeting - gains.blend_from) / (gains.blend_to - gains.blend_from), 0.0), 1.0)
    share = share * share * (3.0 - 2.0 * share)
    ahead = np.array((math.cos(heading), math.sin(heading), 0.0)) * (1.0 - share) + v_a * (share / max(speed, 1e-6))
    y = _cross(force, ahead)
    size = math.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
    if size < 0.05 * a.m * a.g:
        y = rotate(last, np.array((0.0, 1.0, 0.0)))
        size = 1.0
    y = y / size
    slip = v_a[0] * y[0] + v_a[1] * y[1] + v_a[2] * y[2]
    lift = 0.5 * a.rho * a.S * speed * a.C_l * (1.0 - a.xi_f / a.xi_m)
    x = force + lift * (v_a - slip * y)
    along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
    x = x - along * y
    x = x / max(math.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2), 1e-6)
    q = _from_axes(x, y, _cross(x, y))
    if q[0] * last[0] + q[1] * last[1] + q[2] * last[2] + q[3] * last[3] < 0.0:
        q = -q
    return np.asarray(q)


@njit(cache=True)
def _moment(q: Array, w: Array, q_d: Array, law: Array, gains: SightGains, a: Airframe, dt: float) -> Array:
    """Moment that makes q follow q_d and its filtered rate, body, (3,) [N m]; the law's state advanced."""
    last, turning = law[ATTITUDE : ATTITUDE + 4], law[TURNING : TURNING + 3]
    moved = multiply(conjugate(last), q_d)
    keep = math.exp(-gains.turn_filter * dt)
    for i in range(3):
        rate = min(max(2.0 * math.copysign(1.0, moved[0]) * moved[i + 1] / dt, -gains.most_rate), gains.most_rate)
        turning[i] = keep * turning[i] + (1.0 - keep) * rate
    last[:] = q_d
    off = multiply(conjugate(q_d), q)
    follow = rotate_inverse(off, turning)
    sign = 1.0 if off[0] >= 0.0 else -1.0
    turn = np.empty(3)
    for i in range(3):
        turn[i] = -2.0 * gains.attitude[i] * sign * off[i + 1]
    size = math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    turn *= min(1.0, gains.most_rate / max(size, 1e-9))
    J = np.array((a.J1, a.J2, a.J3))
    return np.asarray(J * gains.rate * (turn + follow - w) + _cross(w, J * w))


@njit(cache=True)
def _cross(a: Array, b: Array) -> Array:
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


@njit(cache=True)
def _from_axes(x: Array, y: Array, z: Array) -> Array:
    """The quaternion of the frame with these unit axes, (4,)."""
    trace = x[0] + y[1] + z[2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(1.0 + trace)
        q = np.array((0.25 * s, (y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s))
    elif x[0] >= y[1] and x[0] >= z[2]:
        s = 2.0 * math.sqrt(1.0 + x[0] - y[1] - z[2])
        q = np.array(((y[2] - z[1]) / s, 0.25 * s, (y[0] + x[1]) / s, (z[0] + x[2]) / s))
    elif y[1] >= z[2]:
        s = 2.0 * math.sqrt(1.0 + y[1] - x[0] - z[2])
        q = np.array(((z[0] - x[2]) / s, (y[0] + x[1]) / s, 0.25 * s, (z[1] + y[2]) / s))
    else:
        s = 2.0 * math.sqrt(1.0 + z[2] - x[0] - y[1])
        q = np.array(((x[1] - y[0]) / s, (z[0] + x[2]) / s, (z[1] + y[2]) / s, 0.25 * s))
    return np.asarray(q)
