r"""Wing and elevons that stall: attached flow gives way to a flat plate's, and the slipstream keeps its part attached.

Each half wing has a part in its propeller's slipstream and a part in the free stream, and in each a fixed surface and
an elevon that carries the share xi_f of the lift slope. A surface feels the velocity u of its own centre of pressure
through the air, body rates included, and pushes against it along its normal n, which the elevon turns:

.. math::
    F = -\tfrac12 \rho S_i |u| \, C(\alpha) \, (n \cdot u) \, n, \quad
    C = \sigma C_l + (1 - \sigma) C_{90}, \quad
    \sigma = \frac{1}{1 + (\sin^2 \alpha / \sin^2 \alpha_s)^2}

so that the power F u of every surface is negative: a still wing gains no energy, whatever the elevons do. Detached, the
centre of pressure moves from the quarter chord towards mid-chord. By momentum theory the slipstream flows at
sqrt(V^2 + 2 T / (rho S_p)) over the area S_ratio S_p, which at rest makes the report's elevon force
S_ratio C_l xi_f delta T.

A propeller leaves its torque behind as swirl. Of the wing in its slipstream one part meets that from below, the other
from above, and both may be stalled at rest: then air across the wing is felt little, until it fills the one and
empties the other. A propeller in air across its axis is pushed along with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe, attached_share, elevon_arm
from sitl.model.propeller import speed_for, thrust, torque_difference
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

SPEED_FLOOR = 1e-9  # added to a speed that is divided by [m/s]
LEAST_ACROSS = 0.05  # air across a wing over which forces are told [m/s]


class LocalFlow(NamedTuple):
    """The air that meets one part of a half wing."""

    ahead: float  # along x_b [m/s]
    half_flow: float  # half of the air that flows through its area: rho area speed / 2 [kg/s]
    slope: float  # C of the incidence [1/rad]
    shift: float  # of the centre of pressure behind that of attached flow [m]


class SideSlopes(NamedTuple):
    """Of one half wing; see :class:`sitl.model.aerodynamics.Slopes`."""

    normal: float
    moment: float
    drag: float
    elevon: float


@kernel
def slipstream_speed(ahead: float, T: float, a: Airframe) -> float:
    """Speed of the air behind a propeller, along x_b [m/s]."""
    square = ahead * abs(ahead) + 2.0 * T / (a.rho * a.S_p)
    size = math.sqrt(abs(square))
    return size if square >= 0.0 else -size


@kernel
def _stream(ahead: float, side: float, normal: float, area: float, cp_shift: float, a: Airframe) -> LocalFlow:
    """Local flow at a part of the wing of some area [m2], from the velocity of the air it meets [m/s]."""
    square = ahead * ahead + side * side + normal * normal
    speed = math.sqrt(square) + SPEED_FLOOR
    sine = abs(normal) / speed
    attached = attached_share(sine, a)
    slope = attached * a.C_l + (1.0 - attached) * a.C_90
    return LocalFlow(ahead, 0.5 * a.rho * area * speed, slope, (1.0 - attached) * cp_shift * sine)


@kernel
def _arms(shift: float, a: Airframe) -> tuple[float, float]:
    """Of the fixed surface and of the elevon, behind the centre of mass [m]; together they are at Delta_r attached."""
    elevon = elevon_arm(a)
    return (a.Delta_r - a.xi_f * elevon) / (1.0 - a.xi_f) + shift, elevon


@subroutine
def side_slopes(v: Vector, T: float, a: Airframe) -> SideSlopes:
    """Slopes of one half wing at a thrust [N], without rates and deflection."""
    slip, free = _parts(v.x, v.y, v.z, T, a)
    normal, moment, elevon, drag = 0.0, 0.0, 0.0, free.half_flow * a.C_d0
    if a.swirl > 0.0:
        normal, moment, elevon = _swirled_slopes(v, T, a)
    else:
        normal, moment, elevon = _pushed(slip, slip.half_flow * slip.slope, normal, moment, elevon, a)
    normal, moment, elevon = _pushed(free, free.half_flow * free.slope, normal, moment, elevon, a)
    if a.k_h > 0.0:
        hub = a.k_h * speed_for(T, v.x, a)
        normal += hub
        moment -= a.p_x * hub
    return SideSlopes(normal, moment, drag, elevon)


@kernel
def _pushed(
    part: LocalFlow, push: float, normal: float, moment: float, elevon: float, a: Airframe
) -> tuple[float, float, float]:
    """Slopes of the normal force, of the moment and by the elevon, with those of another part."""
    wing, flap = _arms(part.shift, a)
    moment += push * ((1.0 - a.xi_f) * wing + a.xi_f * flap)
    return normal + push, moment, elevon + part.half_flow * part.slope * a.xi_f * part.ahead


@kernel
def _swirled_slopes(v: Vector, T: float, a: Airframe) -> tuple[float, float, float]:
    """The same of both parts in a swirling slipstream: forces over the air across the wing, which they are not of."""
    across = max(abs(v.z), LEAST_ACROSS)
    normal, moment, elevon = 0.0, 0.0, 0.0
    ahead = slipstream_speed(v.x, T, a)
    turning = _swirl(ahead, T, a)
    for met in (across + turning, across - turning):
        part = _stream(ahead, v.y, met, 0.5 * a.S_ratio * a.S_p, a.slip_shift, a)
        push = part.half_flow * part.slope * met / across
        normal, moment, elevon = _pushed(part, push, normal, moment, elevon, a)
    return normal, moment, elevon


@kernel
def _swirl(ahead: float, T: float, a: Airframe) -> float:
    """Speed across the wing of a slipstream that turns [m/s]: by the torque, which goes with the thrust."""
    jet = 2.0 * abs(T) / (a.rho * a.S_p)
    return a.swirl * jet / max(abs(ahead), math.sqrt(jet), SPEED_FLOOR)


@kernel
def _parts(ahead: float, side: float, normal: float, T: float, a: Airframe) -> tuple[LocalFlow, LocalFlow]:
    """The part in the slipstream and the part outside it."""
    wet = a.S_ratio * a.S_p
    return (
        _stream(slipstream_speed(ahead, T, a), side, normal, wet, a.slip_shift, a),
        _stream(ahead, side, normal, 0.5 * a.S - wet, a.cp_shift, a),
    )


@subroutine
def wrench(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> tuple[Vector, Vector]:
    """Sum of forces [N] and of moments [N m]; arguments as for :func:`sitl.model.aerodynamics.wrench`."""
    w1, w2, d1, d2 = actuators
    T1, T2 = _thrust(w1, v, a), _thrust(w2, v, a)
    left, left_moment = _half_wing(v, w, T1, d1, a.a_y, a)
    right, right_moment = _half_wing(v, w, T2, d2, -a.a_y, a)
    # What the strips of the wing do not tell of the damping: by the chord, and by the fins.
    h = 0.5 * a.rho * a.S * math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)
    pitch, yaw = 0.5 * h * a.c * a.c * a.C_mq, 0.5 * h * a.b * a.b * a.C_nr
    spin = -a.J_p * (w1 - w2)  # of the propellers about x_b: against the torques they are turned by
    hub_force, hub_moment = _pushed_hubs(v, w, w1, w2, a)
    return (
        Vector(T1 + T2 + left.x + right.x, left.y + right.y + hub_force.y, left.z + right.z + hub_force.z),
        Vector(
            torque_difference(w1, w2, v.x, a) + left_moment.x + right_moment.x + hub_moment.x,
            left_moment.y + right_moment.y - pitch * w.y - w.z * spin + hub_moment.y,
            left_moment.z + right_moment.z - a.p_y * (T1 - T2) - yaw * w.z + w.y * spin + hub_moment.z,
        ),
    )


@kernel
def _thrust(speed: float, v: Vector, a: Airframe) -> float:
    """Thrust [N] in a stream that also crosses the disc, which brings it fresh air: less is induced (H. Glauert)."""
    T = thrust(speed, v.x, a)
    if a.k_fc == 0.0 or T <= 0.0:
        return T
    across, jet = v.y * v.y + v.z * v.z, 2.0 * T / (a.rho * a.S_p)
    return T + a.k_fc * across * jet / (jet + v.x * v.x + across)


@kernel
def _pushed_hubs(v: Vector, w: Vector, w1: float, w2: float, a: Airframe) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] of the air that crosses both discs: against the velocity of their hubs."""
    if a.k_h == 0.0:
        return Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    aside, down = v.y + w.z * a.p_x, v.z - w.y * a.p_x
    y = -a.k_h * (w1 + w2) * aside
    left, right = -a.k_h * w1 * (down + w.x * a.p_y), -a.k_h * w2 * (down - w.x * a.p_y)
    return Vector(0.0, y, left + right), Vector(a.p_y * (left - right), -a.p_x * (left + right), a.p_x * y)


@subroutine
def normal_force(v: Vector, w: Vector, actuators: Actuators, a: Airframe) -> float:
    """The force along z_b of :func:`wrench`, to the bit, without the rest [N]."""
    left, _ = _half_wing(v, w, _thrust(actuators.left_motor, v, a), actuators.left_elevon, a.a_y, a)
    right, _ = _half_wing(v, w, _thrust(actuators.right_motor, v, a), actuators.right_elevon, -a.a_y, a)
    hub_force, _ = _pushed_hubs(v, w, actuators.left_motor, actuators.right_motor, a)
    return left.z + right.z + hub_force.z


@kernel
def _half_wing(v: Vector, w: Vector, T: float, delta: float, y: float, a: Airframe) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] of the half wing at ``y`` [m], its elevon at ``delta`` [rad]."""
    ahead, normal = v.x - w.z * y, v.z + w.x * y
    # Only the direction counts, so that short series do: the power is negative along any normal.
    square = delta * delta
    sine, cosine = delta * (1.0 - square * (1.0 / 6.0 - square / 120.0)), 1.0 - square * (0.5 - square / 24.0)
    slip, free = _parts(ahead, v.y, normal, T, a)
    if a.swirl > 0.0:
        fx1, fz1, my1, mx1, mz1 = _in_swirl(Vector(slip.ahead, v.y, normal), T, w.y, sine, cosine, a)
    else:
        fx1, fz1, my1, mx1, mz1 = _surfaces(slip, normal, w.y, sine, cosine, a)
    fx2, fz2, my2, mx2, mz2 = _surfaces(free, normal, w.y, sine, cosine, a)
    side = -(slip.half_flow + free.half_flow) * a.C_y0 * v.y
    return Vector(fx1 + fx2, side, fz1 + fz2), Vector(y * (mx1 + mx2), my1 + my2, -y * (mz1 + mz2))


@kernel
def _in_swirl(
    flow: Vector, T: float, pitch_rate: float, sine: float, cosine: float, a: Airframe
) -> tuple[float, float, float, float, float]:
    """:func:`_surfaces` of both parts of a half wing in a slipstream that turns."""
    turning, half = _swirl(flow.x, T, a), 0.5 * a.S_ratio * a.S_p
    up, down = flow.z + turning, flow.z - turning
    fx1, fz1, my1, mx1, mz1 = _surfaces(
        _stream(flow.x, flow.y, up, half, a.slip_shift, a), up, pitch_rate, sine, cosine, a
    )
    fx2, fz2, my2, mx2, mz2 = _surfaces(
        _stream(flow.x, flow.y, down, half, a.slip_shift, a), down, pitch_rate, sine, cosine, a
    )
    return fx1 + fx2, fz1 + fz2, my1 + my2, mx1 + mx2, mz1 + mz2


@kernel
def _surfaces(
    part: LocalFlow, normal: float, pitch_rate: float, sine: float, cosine: float, a: Airframe
) -> tuple[float, float, float, float, float]:
    """F_x, F_z [N], M_y [N m], and the forces along z_b and x_b that have the arm of the half wing [N]."""
    push = part.half_flow * part.slope
    wing_arm, flap_arm = _arms(part.shift, a)
    wing = -push * (1.0 - a.xi_f) * (normal + pitch_rate * wing_arm)
    flap = -push * a.xi_f * (sine * part.ahead + cosine * (normal + pitch_rate * flap_arm))
    axial = flap * sine - part.half_flow * a.C_d0 * part.ahead
    across = flap * cosine
    return axial, wing + across, wing_arm * wing + flap_arm * across, wing + across, axial
