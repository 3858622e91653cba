r"""Flatness transform of phi-theory: attitude and thrust of a force, in closed form at a lift slope.

Of the wing, its elevons in trim, with the normal force k by the velocity along z_b, and without sideslip,

.. math::
    f = T x_b - D (v_a \cdot x_b) x_b - k (v_a \cdot z_b) z_b
    \quad\Rightarrow\quad x_b \parallel f + k (v_a - (v_a \cdot y_b) y_b)

whatever the incidence: z_b is square to x_b and y_b, so that f and k v_a cancel along it. Where the wing stalls, k is
that of the incidence it leads to, and is found by repetition. The span y_b is square to f and to where the vehicle
looks: a heading while it hovers, the air velocity in flight (a turn without sideslip).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.aerodynamics import slopes, trimmed_slope
from sitl.model.airframe import Airframe
from sitl.model.arithmetic import clipped, sine_cosine
from sitl.model.quaternions import Quaternion, rotate_inverse, z_axis
from sitl.model.vectors import Vector, add_scaled, cross, dot, norm, scaled

MIN_FORCE_ACROSS = 0.05  # of the weight: a smaller one across the view leaves the span where it was [-]
SLOPE_PASSES = 2  # of the lift slope in one tick; the next tick goes on from there
# A wing that falls is not leant on: nose and air velocity agree in a dive, which would have no end.
CARRIES, CARRIES_NOT = 5.0, 9.0  # sink rates through the air [m/s]
# Neither is one that stands edge-on in a wind.
MEETS_NOT, MEETS = 0.5, 0.8  # shares of the airspeed across the span [-]
MEETS_FROM = 3.0  # airspeed from which that counts, from twice of it fully [m/s]
FELT_SHARE = 0.5  # of the force on it that is made up for: more of it swings, with less it creeps [-]


class Flat(NamedTuple):
    """Attitude and thrust that give a force."""

    attitude: Quaternion
    thrust: float  # of both propellers [N]


class View(NamedTuple):
    """Direction in which the belly looks, and where heading or air stream do not tell it."""

    heading: float  # of the belly without airspeed [rad]
    last: Quaternion  # the attitude before: whose sign and, where nothing else decides, whose span is kept
    blend_from: float  # airspeeds between which the heading gives way to the air stream [m/s]
    blend_to: float


@subroutine
def transform(force: Vector, v_a: Vector, view: View, thrust: float, a: Airframe) -> Flat:
    """The attitude and the thrust of a force in quasi-steady flight.

    Args:
        force: Of air and propellers, wanted, world [N].
        v_a: Velocity through the air, world [m/s].
        view: Where to look; near its last attitude the incidence is sought.
        thrust: Of both propellers before [N].
        a: The airframe as the law knows it.
    """
    y = span(force, v_a, view, a.m * a.g)
    carries, meets = carrying(v_a), meeting(v_a, y)
    q = view.last
    force = add_scaled(force, z_axis(q), FELT_SHARE * carries * (1.0 - meets) * felt(q, v_a, thrust, a))
    for _ in range(SLOPE_PASSES):
        stream = slopes(rotate_inverse(q, v_a), 0.5 * thrust, 0.5 * thrust, a)
        x = nose(force, v_a, y, carries * meets * trimmed_slope(stream, a))
        q = from_axes(x, y, view.last)
        thrust = max(dot(force, x) + stream.drag * dot(v_a, x), 0.0) / (1.0 - a.S_ratio * a.C_d0)
    return Flat(q, thrust)


@kernel
def carrying(v_a: Vector) -> float:
    """Share of the wing's force that is counted on at a velocity through the air, world [m/s]."""
    return clipped((CARRIES_NOT + v_a.z) / (CARRIES_NOT - CARRIES), 0.0, 1.0)


@kernel
def meeting(v_a: Vector, y: Vector) -> float:
    """Share of the wing's force that is counted on by how much of the air, world [m/s], meets a wing with that span.

    Along the span a strong wind makes every small motion across it count for much: leant on, the wing would be thrown
    from standing into flying sideways and back.
    """
    speed, slip = norm(v_a), dot(v_a, y)
    across = math.sqrt(max(speed * speed - slip * slip, 0.0))
    share = clipped((across - MEETS_NOT * speed) / ((MEETS - MEETS_NOT) * max(speed, 1e-6)), 0.0, 1.0)
    weight = clipped((speed - MEETS_FROM) / MEETS_FROM, 0.0, 1.0)
    return 1.0 - weight * (1.0 - share)


@kernel
def felt(q: Quaternion, v_a: Vector, thrust: float, a: Airframe) -> float:
    """The wing's force at an attitude, against z_b [N]: what is not leant on is pushed against."""
    v = rotate_inverse(q, v_a)
    return trimmed_slope(slopes(v, 0.5 * thrust, 0.5 * thrust, a), a) * v.z


@kernel
def span(force: Vector, v_a: Vector, view: View, weight: float) -> Vector:
    """y_b, world: square to the force and to the heading or, with air from ahead, to the air velocity.

    Args:
        force: Wanted, world [N].
        v_a: Velocity through the air, world [m/s].
        view: Where to look.
        weight: Of the vehicle [N].
    """
    speed = norm(v_a)
    sine, cosine = sine_cosine(view.heading)
    # Only air that comes from ahead may take the heading over: a tail wind at the stop would turn it round.
    ahead_of = v_a.x * cosine + v_a.y * sine
    share = clipped((ahead_of - view.blend_from) / (view.blend_to - view.blend_from), 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    ahead = add_scaled(Vector(cosine * (1.0 - share), sine * (1.0 - share), 0.0), v_a, share / max(speed, 1e-6))
    y = cross(force, ahead)
    size = norm(y)
    return scaled(y, 1.0 / size) if size >= MIN_FORCE_ACROSS * weight else _y_axis(view.last)


@kernel
def nose(force: Vector, v_a: Vector, y: Vector, carried: float) -> Vector:
    """x_b, world, of a force [N] and a span at a normal force by the velocity along z_b [N s/m]."""
    slip = dot(v_a, y)
    x = add_scaled(force, add_scaled(v_a, y, -slip), carried)
    x = add_scaled(x, y, -dot(x, y))
    return scaled(x, 1.0 / max(norm(x), 1e-6))


@kernel
def from_axes(x: Vector, y: Vector, last: Quaternion) -> Quaternion:
    """The attitude with these unit axes, of the sign of the one before."""
    q = _from_axes(x, y, cross(x, y))
    same = q.w * last.w + q.x * last.x + q.y * last.y + q.z * last.z >= 0.0
    return q if same else Quaternion(-q.w, -q.x, -q.y, -q.z)


@kernel
def _y_axis(q: Quaternion) -> Vector:
    """y_b in the world frame: the left wing."""
    return Vector(2.0 * (q.x * q.y - q.w * q.z), 1.0 - 2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z + q.w * q.x))


@kernel
def _from_axes(x: Vector, y: Vector, z: Vector) -> Quaternion:
    """The quaternion of the frame with these unit axes; its largest component is the one under the root."""
    trace = x.x + y.y + z.z
    largest = max(x.x, y.y, z.z)
    root = math.sqrt(1.0 + (trace if trace > 0.0 else 2.0 * largest - trace))
    half, k = 0.5 * root, 0.5 / root
    if trace > 0.0:
        return Quaternion(half, k * (y.z - z.y), k * (z.x - x.z), k * (x.y - y.x))
    if x.x >= largest:
        return Quaternion(k * (y.z - z.y), half, k * (y.x + x.y), k * (z.x + x.z))
    if y.y >= largest:
        return Quaternion(k * (z.x - x.z), k * (y.x + x.y), half, k * (z.y + y.z))
    return Quaternion(k * (x.y - y.x), k * (z.x + x.z), k * (z.y + y.z), half)
