r"""One leg flown by a point mass: the laws' own guidance on the wing's own trims, without attitude dynamics.

What the position loops ask for - the velocity governor upright, :mod:`sitl.laws.forward_guidance` on the wing - is the
acceleration, late by the attitude's lag; attitude, thrust and elevons are those that give it in quasi-steady flight:

.. math::
    x_d \parallel F + L |v_a| (v_a - (v_a \cdot y) y), \qquad L = \tfrac12 \rho S C_l (1 - \xi_f / \xi_m)

So the prediction climbs where the stop climbs and idles where the motors idle, and follows the laws when they change.
The leg's frame: x along it, y to its left, z up, origin at its beginning.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.flow import TURN_BELOW, TURN_RATE
from sitl.laws.forward_guidance import GuidanceGains, brake, cruise, due_to_stop, stopping_distance
from sitl.laws.governor import GovernorParameters, gamma
from sitl.laws.path import LEG, Path, progress
from sitl.model.airframe import Airframe, Array
from sitl.watch import STANDING_SPEED, STILL

STEP = 0.05  # [s]
AHEAD = 1e-4  # of the zero-moment law's derivatives [s]
LONGEST = 6000  # steps
STEADY = 0.02  # acceleration [m/s2], or climb rate [m/s], that counts as none
STOPPED = 12.0  # more than stopping from a creep takes [m]
FAR_OFF = 6.0  # the governor is at its limit so many seconds away
EARLY = 1.1  # braking distances before which nothing changes
ALIGNED = math.radians(12.0)  # a heading so near ends the alignment [rad]
HALF = math.sqrt(0.5)


class LinearHover(NamedTuple):
    """The linear hover law as a point mass feels it, and its V."""

    k_p: float  # level position [1/s2]
    k_v: float  # level velocity [1/s]
    k_z: float  # altitude [1/s2]
    k_vz: float  # climb rate [1/s]
    k_i: float  # integral of the level error [1/s3]
    k_iz: float  # of the altitude's [1/s3]
    lead: float  # of the integral [s]
    integral_limit: float  # [m]
    reach: float  # [m]
    S: Array  # of V, (12, 12)
    v_enter: float
    v_leave: float
    settled: float  # V below which a stop on the wing hands over


class Body(NamedTuple):
    """What flies: the airframe with its laws."""

    airframe: Airframe
    guidance: GuidanceGains
    governor: GovernorParameters
    linear: LinearHover
    lag: float  # of the attitude on the wing [s]
    hover_lag: float  # upright [s]
    k_delta: float  # of the zero-moment law [1/s]
    lam: float  # its attitude bandwidth [rad/s]
    turn: float  # bandwidth of the heading in the alignment [rad/s]
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


@njit(cache=True)
def trim(force: Array, v_a: Array, ahead: Array, a: Airframe) -> tuple[Array, float, float]:
    """Nose direction (3,), thrust of each motor [N] and elevons [rad] that give a force in quasi-steady flight.

    Args:
        force: Aerodynamic force wanted, weight included, (3,) [N].
        v_a: Velocity through the air, (3,) [m/s].
        ahead: Where the belly points, level, (3,): decides the span where the air does not.
        a: The airframe.
    """
    y = _cross(force, ahead)
    y /= max(_norm(y), 1e-6)
    slip, speed = _dot(v_a, y), _norm(v_a)
    h = 0.5 * a.rho * a.S * speed
    x = force + h * a.C_l * (1.0 - a.xi_f / a.xi_m) * (v_a - slip * y)
    x -= _dot(x, y) * y
    x /= max(_norm(x), 1e-6)
    vx, vz = _dot(v_a, x), _dot(v_a, _cross(x, y))
    thrust = 0.5 * (_dot(force, x) + h * a.C_d0 * vx) / (1.0 - a.S_ratio * a.C_d0)
    held = min(max(thrust, a.k_f * a.omega_min**2), a.k_f * a.omega_max**2)
    grip = max(a.S_ratio * held + 0.5 * h * vx, 1e-3)
    return x, thrust, -0.5 * h * vz / (a.xi_m * grip)


@njit(cache=True)
def fly_wing(
    wind: Array,
    path: Path,
    body: Body,
    waiting: float,
    learnt: Array,
    heading: float,
    stand: float,
    acceptance: float,
    begin: bool,
    end: bool,
    riding: bool,
) -> tuple[float, float]:
    """Time [s] and energy [J] of a leg on the wing, or upright in a wind, infinite if it never arrives.

    Args:
        wind: Of the leg's frame, (3,) [m/s].
        path: The leg, from the origin along x.
        body: What flies.
        waiting: Of the alignment [s].
        learnt: What the integral of the linear hover law held against before the leg, (3,) [N].
        heading: At its beginning, from the leg's direction to the left [rad].
        stand: Heading of the hover at its end, likewise [rad].
        acceptance: Distance to the end that counts as arrived [m].
        begin: Whether it begins in the hover, else in the cruise.
        end: Whether it ends in the hover, else abeam of its end.
        riding: Whether it is flown upright all along under the law of the transition to the hover.
    """
    a, gains = body.airframe, body.guidance
    p, v, acceleration, integral = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    time = energy = travel = 0.0
    if begin:
        belly = np.array((math.cos(heading), math.sin(heading), 0.0))
        time, energy = waiting, waiting * _power_of(_weight(a), -wind, belly, a)
    else:
        v[0] = wind[0] + math.sqrt(max(path.airspeed**2 - wind[1] ** 2, 4.0))
    wanted, braking, arrived = np.zeros(3), riding, False
    still = math.hypot(wind[0], wind[1]) < STILL  # else the law of the transition goes on upright
    for _ in range(LONGEST):
        along, length, _ = progress(path, p)
        if not end and along >= length:
            break
        braking = braking or (end and due_to_stop(p, v, wind, path, 1.0, gains))
        asked, heading = _guide(p, v, wind, path, travel, integral, (heading, stand), braking, gains)
        _approach(wanted, asked, gains.jerk * STEP)
        wanted[2] = min(max(wanted[2], -gains.down), gains.up)
        acceleration += (wanted - acceleration) * (1.0 - math.exp(-STEP / body.lag))
        ahead = _ahead(heading, v - wind, body)
        travel, watts = _move(p, v, wind, acceleration, ahead, a)
        time += STEP
        energy += watts * STEP
        if braking == riding and _norm(acceleration) < STEADY:
            rest = _creeping(p - path.end, v) if riding else _straight(p, v, integral, wind, path, gains)
            p += rest * v
            time += rest
            energy += rest * _power_of(_weight(a), v - wind, ahead, a)
        off = p - path.end
        arrived = arrived or (end and _norm(off) <= acceptance)
        if braking and _norm(v) < STANDING_SPEED:
            x = trim(a.m * acceleration + _weight(a), v - wind, ahead, a)[0]
            value = _lyapunov(off, v, x, stand, heading, body.linear)
            if arrived and value < body.linear.v_enter:
                break
            if still and value < body.linear.settled:
                rest, used = fly_hover(off, v, wind, stand, learnt, 1.0, body, acceptance, True)
                time, energy = time + rest, energy + used
                break
    else:
        return math.inf, math.inf
    return time, energy


@njit(cache=True)
def _guide(
    p: Array,
    v: Array,
    wind: Array,
    path: Path,
    travel: float,
    integral: Array,
    headings: tuple[float, float],  # now, and of the hover to come [rad]
    braking: bool,
    gains: GuidanceGains,
) -> tuple[Array, float]:
    """Acceleration that the guidance asks for, (3,) [m/s2], and the heading [rad]."""
    heading, stand = headings
    if not braking:
        return cruise(p, v, wind, path, integral, STEP, gains), math.atan2(v[1] - wind[1], max(v[0] - wind[0], 1.0))
    if math.hypot(v[0], v[1]) < TURN_BELOW:
        heading += min(max(_angle(stand - heading), -TURN_RATE * STEP), TURN_RATE * STEP)
    return brake(p, v, wind, path, travel, integral, STEP, gains), heading


@njit(cache=True)
def _creeping(off: Array, v: Array) -> float:
    """How long a vehicle that rides the wind goes on as it is [s]."""
    distance = math.hypot(off[0], off[1])
    closing = -(off[0] * v[0] + off[1] * v[1]) / max(distance, 1e-6)
    return float(max(distance - STOPPED, 0.0) / closing) if closing > 1.0 and abs(v[2]) < STEADY else 0.0


@njit(cache=True)
def _straight(p: Array, v: Array, integral: Array, wind: Array, path: Path, gains: GuidanceGains) -> float:
    """How long a steady cruise goes on as it is: until the leg's level end, or shortly before its braking [s].

    The linear law flies it, which holds the airspeed.
    """
    integral[:] = 0.0
    v[0] = wind[0] + math.sqrt(max(path.airspeed**2 - wind[1] ** 2, 4.0))
    along, length, _ = progress(path, p)
    close = path.level if along < length - path.level else 0.0
    if path.stop:
        close = max(close, EARLY * stopping_distance(v[0], wind[0], wind[1], gains))
    return float(max(length - close - along, 0.0) / max(v[0], 1.0))


@njit(cache=True)
def _ahead(heading: float, v_a: Array, body: Body) -> Array:
    """What decides the span: the heading, which gives way to air that comes from ahead, level, (3,)."""
    c, s, speed = math.cos(heading), math.sin(heading), _norm(v_a)
    share = (v_a[0] * c + v_a[1] * s - body.blend_from) / (body.blend_to - body.blend_from)
    share = min(max(share, 0.0), 1.0)
    share = share * share * (3.0 - 2.0 * share)
    return np.asarray(np.array((c, s, 0.0)) * (1.0 - share) + v_a * (share / max(speed, 1e-6)))


@njit(cache=True)
def _move(p: Array, v: Array, wind: Array, acceleration: Array, ahead: Array, a: Airframe) -> tuple[float, float]:
    """One step of the motion, in place; share of the elevons' travel in use, and power [W]."""
    x, thrust, delta = trim(a.m * acceleration + _weight(a), v - wind, ahead, a)
    held = min(max(thrust, a.k_f * a.omega_min**2), a.k_f * a.omega_max**2)
    # What the motors cannot give, or not take back, is missing from the acceleration.
    real = acceleration + x * (2.0 * (1.0 - a.S_ratio * a.C_d0) * (held - thrust) / a.m)
    p += STEP * (v + 0.5 * STEP * real)
    v += STEP * real
    return min(abs(delta) / a.delta_max, 1.0), _shaft(held, a)


@njit(cache=True)
def fly_hover(
    off: Array,
    v: Array,
    wind: Array,
    heading: float,
    learnt: Array,
    speed: float,
    body: Body,
    acceptance: float,
    linear: bool,
) -> tuple[float, float]:
    """Time [s] and energy [J] upright until within acceptance of a point, infinite if it is never reached.

    Args:
        off: Position less the point, (3,) [m].
        v: Velocity, (3,) [m/s].
        wind: (3,) [m/s].
        heading: From the leg's direction to the left [rad]: the wing feels no wind along its span.
        learnt: What the integral of the linear law holds against, (3,) [N].
        speed: Limit of the velocity governor [m/s].
        body: What flies.
        acceptance: [m].
        linear: Whether the linear law flies at first.
    """
    a, law = body.airframe, body.linear
    e, v, x = off.copy(), v.copy(), np.array((0.0, 0.0, 1.0))
    ahead = np.array((math.cos(heading), math.sin(heading), 0.0))
    force, real, integral = _weight(a), np.zeros(3), np.zeros(3)
    time = energy = sag = 0.0
    for _ in range(LONGEST):
        if _norm(e) <= acceptance:
            return time, energy
        value = _lyapunov(e, v, x, heading, heading, law)
        linear = value < law.v_leave if linear else value < law.v_enter
        if linear:
            asked = _weight(a) + a.m * _linear(e, v, integral, law) - learnt
            force += (asked - force) * (1.0 - math.exp(-STEP / body.hover_lag))
            sag = 0.0
        else:
            force += STEP * _steer(e, v, force, speed, body)
        x = force / max(_norm(force), 1e-6)
        if not linear:
            sag += (_sag(v - wind, x, force, real, ahead, body) - sag) * (1.0 - math.exp(-STEP / body.hover_lag))
            x = math.cos(sag) * x - math.sin(sag) * _normal(x, ahead)
        z = _normal(x, ahead)
        lift = 0.5 * a.rho * a.S * a.C_l * (1.0 - a.xi_f / a.xi_m) * _norm(v - wind)
        real = (_norm(force) * x - lift * _dot(v - wind, z) * z - _weight(a)) / a.m
        step = STEP
        if not linear and _norm(real) < STEADY:
            step += _steady(e, v, FAR_OFF * speed)
        e += step * v + 0.5 * STEP * STEP * real
        v += STEP * real
        time += step
        thrust = 0.5 * _norm(force) / (1.0 - a.S_ratio * a.C_d0)
        energy += step * _shaft(min(max(thrust, a.k_f * a.omega_min**2), a.k_f * a.omega_max**2), a)
    return math.inf, math.inf


@njit(cache=True)
def _steady(e: Array, v: Array, near: float) -> float:
    """How long a governed flight goes on as it is: its speeds do not depend on distances that are great [s]."""
    distance = math.hypot(e[0], e[1])
    closing = -(e[0] * v[0] + e[1] * v[1]) / max(distance, 1e-6)
    level = max(distance - near, 0.0) / closing if closing > 0.0 else 0.0
    vertical = max(abs(e[2]) - near, 0.0) / abs(v[2]) if abs(v[2]) >= STEADY else math.inf
    return float(min(level, vertical))


@njit(cache=True)
def _steer(e: Array, v: Array, force: Array, speed: float, body: Body) -> Array:
    """Rate of the zero-moment law's force: its nu, (3,) [N/s]."""
    a = body.airframe
    promised = (force - _weight(a)) / a.m  # the law knows of no wing: what is missing stays missing
    now = _governed(e, v, speed, body)
    rate = (_governed(e + AHEAD * v, v + AHEAD * promised, speed, body) - now) / AHEAD
    return np.asarray(rate - body.k_delta * (force - _weight(a) - now))


@njit(cache=True)
def _governed(e: Array, v: Array, speed: float, body: Body) -> Array:
    x, y, z = gamma((e[0], e[1], e[2]), (v[0], v[1], v[2]), speed, body.governor)
    return np.array((x, y, z))


@njit(cache=True)
def _sag(v_a: Array, x: Array, force: Array, real: Array, ahead: Array, body: Body) -> float:
    """How far the wing's moment turns the nose to the belly from where the zero-moment law wants it [rad].

    That law has no integral, and its feed-forward turns the nose after an acceleration that the wing does not allow.
    """
    a, z = body.airframe, _normal(x, ahead)
    h, thrust = 0.5 * a.rho * a.S * _norm(v_a), 0.5 * _norm(force)
    grip = max(a.S_ratio * thrust + 0.5 * h * _dot(v_a, x), 1e-3)
    delta = min(max(-0.5 * h * _dot(v_a, z) / (a.xi_m * grip), -a.delta_max), a.delta_max)
    moment = 2.0 * a.S_ratio * a.C_l * a.xi_m * a.Delta_r * delta * thrust
    missing = (force - _weight(a)) / a.m - real
    turned = body.k_delta * body.governor.k_pd * _dot(missing, z) / _norm(force)
    return float((moment / a.J2 + turned) / body.lam**2)


@njit(cache=True)
def _linear(e: Array, v: Array, integral: Array, law: LinearHover) -> Array:
    """Acceleration that the linear law asks for, (3,) [m/s2]; its integral advanced."""
    near = min(1.0, law.reach / max(_norm(e), 1e-9))
    asked = np.empty(3)
    for i in range(3):
        integral[i] += STEP * min(max(e[i] + law.lead * v[i], -law.integral_limit), law.integral_limit)
        k_p, k_v, k_i = (law.k_z, law.k_vz, law.k_iz) if i == 2 else (law.k_p, law.k_v, law.k_i)
        asked[i] = -k_p * near * e[i] - k_v * v[i] - k_i * integral[i]
    return asked


@njit(cache=True)
def held(wind: Array, heading: float, a: Airframe) -> Array:
    """Force of a wind on the vehicle that hovers in it at a heading, (3,) [N]."""
    ahead = np.array((math.cos(heading), math.sin(heading), 0.0))
    x, thrust, _ = trim(_weight(a), -wind, ahead, a)
    return np.asarray(_weight(a) - 2.0 * (1.0 - a.S_ratio * a.C_d0) * thrust * x)


@njit(cache=True)
def _normal(x: Array, ahead: Array) -> Array:
    """z_b of a nose direction with the belly to a level direction, (3,)."""
    y = _cross(x, ahead)
    y /= max(_norm(y), 1e-6)
    return _cross(x, y)


@njit(cache=True)
def _lyapunov(e: Array, v: Array, x: Array, wanted: float, heading: float, law: LinearHover) -> float:
    """V of the linear hover law without body rates, at a nose direction and a heading when another is wanted."""
    c, s = math.cos(wanted), math.sin(wanted)
    forward = x[0] * math.cos(heading) + x[1] * math.sin(heading)
    nose = math.sin(0.5 * math.atan2(x[2], forward))
    off = 0.5 * _angle(heading - wanted)
    level = (c * e[0] + s * e[1], c * e[1] - s * e[0], c * v[0] + s * v[1], c * v[1] - s * v[0])
    turned = math.sin(off) * HALF
    state = np.array((level[0], level[1], e[2], level[2], level[3], v[2], turned, HALF - math.cos(off) * nose, turned))
    value = 0.0
    for i in range(9):
        for j in range(9):
            value += state[i] * law.S[i, j] * state[j]
    return value


@njit(cache=True)
def _power_of(force: Array, v_a: Array, ahead: Array, a: Airframe) -> float:
    thrust = trim(force, v_a, ahead, a)[1]
    return _shaft(min(max(thrust, a.k_f * a.omega_min**2), a.k_f * a.omega_max**2), a)


@njit(cache=True)
def _shaft(thrust: float, a: Airframe) -> float:
    """Power of both propellers [W]."""
    return float(2.0 * a.k_m * (thrust / a.k_f) ** 1.5)


@njit(cache=True)
def _weight(a: Airframe) -> Array:
    return np.array((0.0, 0.0, a.m * a.g))


@njit(cache=True)
def _approach(value: Array, wanted: Array, most: float) -> None:
    """Move a vector towards another by no more than a length, in place."""
    change = wanted - value
    value += change * min(1.0, most / max(_norm(change), 1e-9))


@njit(cache=True)
def _angle(x: float) -> float:
    return math.atan2(math.sin(x), math.cos(x))


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit(cache=True)
def _norm(a: Array) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@njit(cache=True)
def _cross(a: Array, b: Array) -> Array:
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def alignment(turn: float, bandwidth: float) -> float:
    """Time of turning by an angle to within the alignment's tolerance [s], under psi' = -k sin(psi / 2)."""
    turn = abs(math.remainder(turn, math.tau))
    if turn <= ALIGNED:
        return 0.0
    return 2.0 / bandwidth * math.log(math.tan(0.25 * min(turn, math.pi)) / math.tan(0.25 * ALIGNED))


__all__ = ["LEG", "Body", "LinearHover", "Path", "alignment", "fly_hover", "fly_wing", "trim"]
